"""Layers of features in one GeoPackage, with their styles and the meaning of their fields."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.gis.qml import to_text, vector_style
from pipeline.gis.vectors import Features
from pipeline.store.folder import whole

# QGIS keeps the styles of a GeoPackage in this table, and takes the default one when it opens a layer
STYLES = """
CREATE TABLE layer_styles (
  id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, f_table_catalog TEXT(256), f_table_schema TEXT(256),
  f_table_name TEXT(256), f_geometry_column TEXT(256), styleName TEXT(30), styleQML TEXT, styleSLD TEXT,
  useAsDefault BOOLEAN, description TEXT, owner TEXT(30), ui TEXT(30), update_time DATETIME)
"""
# the schema extension of the standard
COLUMNS = """
CREATE TABLE IF NOT EXISTS gpkg_data_columns (
  table_name TEXT NOT NULL, column_name TEXT NOT NULL, name TEXT, title TEXT, description TEXT,
  mime_type TEXT, constraint_name TEXT, CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name))
"""
EXTENSIONS = """
CREATE TABLE IF NOT EXISTS gpkg_extensions (
  table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL, definition TEXT NOT NULL,
  scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name))
"""
SCHEMA = "http://www.geopackage.org/spec121/#extension_schema"
# read by all that is in use
OLDEST = "1.2"
TYPES = {"Point": "Point", "Line": "LineString", "Polygon": "MultiPolygon"}
# QGIS writes it so; the date makes two files of the same maps equal
WRITTEN = "2000-01-01T00:00:00.000Z"


def write(layers: Sequence[Features], crs: str, path: Path) -> Path:
    """Write layers, those without a feature left out; a file that was there is replaced.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    import pyogrio.raw
    import shapely

    layers = [layer for layer in layers if layer.shapes]
    with whole(path, path.suffix) as aside:
        for number, layer in enumerate(layers):
            columns = [_column([row[name] for row in layer.rows]) for name in layer.fields]
            pyogrio.raw.write(
                aside,
                np.array([shapely.to_wkb(shape) for shape in layer.shapes], dtype=object),
                columns,
                layer.fields,
                geometry_type=TYPES[layer.geometry],
                crs=crs,
                driver="GPKG",
                layer=layer.name,
                append=number > 0,
                dataset_options={} if number else {"VERSION": OLDEST},
                layer_options={"IDENTIFIER": layer.name, "DESCRIPTION": layer.title},
            )
        with sqlite3.connect(aside) as base:
            _describe(base, layers)
        base.close()
    return path


def _column(values: list[Any]) -> Any:
    kind = object if any(isinstance(value, str) for value in values) else None
    found = np.array(values, dtype=kind)
    # a class without an upper end has none
    return np.where(np.isinf(found), np.nan, found) if found.dtype.kind == "f" else found


def _describe(base: sqlite3.Connection, layers: Sequence[Features]) -> None:
    """Add styles, and what the fields mean."""
    for statement in (STYLES, COLUMNS, EXTENSIONS):
        base.execute(statement)
    base.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, last_change) VALUES (?, ?, ?, ?)",
        ("layer_styles", "attributes", "layer_styles", WRITTEN),
    )
    base.execute("UPDATE gpkg_contents SET last_change = ?", (WRITTEN,))
    base.execute(
        "INSERT INTO gpkg_extensions VALUES ('gpkg_data_columns', NULL, 'gpkg_schema', ?, 'read-write')",
        (SCHEMA,),
    )
    for layer in layers:
        named = {name: layer.aliases[name] for name in layer.fields}
        style = to_text(vector_style(layer.marks, layer.geometry, named, layer.labelled))
        base.execute(
            "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, "
            "styleName, styleQML, styleSLD, useAsDefault, description, owner, update_time) "
            "VALUES ('', '', ?, 'geom', ?, ?, '', 1, ?, '', ?)",
            (layer.name, layer.name[:30], style, layer.title, WRITTEN),
        )
        base.executemany(
            "INSERT INTO gpkg_data_columns (table_name, column_name, title, description) VALUES (?, ?, ?, ?)",
            [(layer.name, name, title, title) for name, title in named.items()],
        )
