"""Open a project of QGIS and each of its layers, and tell what QGIS makes of them; run by its own Python.

python3 qgis_look.py PROJECT PICTURE [LAYER ...]: draws the layers of these ids, or those that are checked.
"""

import json
import os
import sys
from pathlib import Path

from qgis.core import (
    QgsApplication,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProject,
    QgsRasterLayer,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QSize


def main(path, picture, wanted):
    QgsApplication.setPrefixPath("/usr", True)
    application = QgsApplication([], False)
    application.initQgis()
    project = QgsProject.instance()
    found = {"read": project.read(path), "crs": project.crs().authid(), "layers": {}, "opened": {}}
    for name, layer in project.mapLayers().items():
        renderer = layer.renderer()
        found["layers"][name] = {
            "valid": layer.isValid(),
            "title": layer.name(),
            "renderer": renderer.type() if renderer else None,
            "crs": layer.crs().authid(),
        }
    found["listed"] = [node.layerId() for node in project.layerTreeRoot().findLayers()]
    checked = [node.layerId() for node in project.layerTreeRoot().findLayers() if node.isVisible()]
    found["checked"] = checked
    settings = QgsMapSettings()
    layers = [project.mapLayer(name) for name in (wanted or checked)]
    settings.setLayers(layers)
    settings.setDestinationCrs(project.crs())
    settings.setOutputSize(QSize(900, 900))
    settings.setExtent(project.mapLayer((wanted or checked)[-1]).extent())
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    job.renderedImage().save(picture)
    # files opened by themselves, as by a double click, take the style that lies with them
    for file in sorted(Path(path).parent.rglob("*.tif")):
        layer = QgsRasterLayer(str(file), file.stem)
        found["opened"][file.name] = {"valid": layer.isValid(), "renderer": layer.renderer().type()}
        if layer.renderer().type() == "paletted":
            classes = layer.renderer().classes()
            found["opened"][file.name]["classes"] = {one.label: one.color.name() for one in classes}
    for file in sorted(Path(path).parent.rglob("*.gpkg")):
        whole = QgsVectorLayer(str(file), "all")
        for name in [each.split("!!::!!")[1] for each in whole.dataProvider().subLayers()]:
            layer = QgsVectorLayer(f"{file}|layername={name}", name)
            layer.loadDefaultStyle()
            found["opened"][f"{file.name}|{name}"] = {
                "valid": layer.isValid(),
                "renderer": layer.renderer().type() if layer.renderer() else None,
                "features": layer.featureCount(),
            }
    print(json.dumps(found), flush=True)
    # what is left to Python to take down may end in a fault of the machine
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
