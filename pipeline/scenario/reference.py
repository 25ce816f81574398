"""The reference of scenario files: every key with unit, default and meaning, from the settings themselves.

``python -m pipeline.scenario.reference > docs/scenario.md`` makes the page.
"""

from __future__ import annotations

from inspect import cleandoc

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pipeline.mistakes import describe
from pipeline.scenario.schema_errors import sections

_HEADER = """# Keys of a scenario file

One YAML file is one scenario. This page is made by `python -m pipeline.scenario.reference`;
`pipeline schema` prints the same as a JSON Schema for editors.
"""
_TABLE = "| key | unit | default | meaning |\n|---|---|---|---|"


def markdown() -> str:
    """Give the page of all keys, as it stands in ``docs/scenario.md``."""
    tables = [
        f"\n## {title}\n\n{cleandoc(model.__doc__ or '')}\n\n{_TABLE}\n" + "\n".join(_rows(model))
        for loc, model in sections()
        if (title := _title(loc)) is not None
    ]
    return "\n".join([_HEADER.rstrip(), *tables]) + "\n"


def _title(loc: tuple[str, ...]) -> str | None:
    """Name a section as a user sees it; None where it is a second way to one that has its table."""
    match loc:
        case ():
            return "The file"
        case (*_, "given") | (_, "many", _):
            return None
        case ("points", kind):
            return f"`points`, layout `{kind}`"
        case ("scheme", kind):
            return f"`scheme`, form `{kind}`"
        case ("points", "graded", *rest):
            return f"`points`, `{'.'.join(rest)}` of layout `graded`"
        case ("release", "one", kind):
            return f"`release`, shape `{kind}`"
        case ("sample", "values", _, kind):
            return f"`sample.values`, distribution `{kind}`"
        case ("sample", "correlations"):
            return "Each of `sample.correlations`"
        case ("receptors",):
            return "Each of `receptors`"
        case ("terrain", kind):
            return f"`terrain`, profile `{kind}`"
        case ("terrain", "segments", name):
            return f"`terrain`, each of `{name}`"
        case _:
            return f"`{'.'.join(loc)}`"


def _rows(model: type[BaseModel]) -> list[str]:
    """List a section's keys, required ones first."""
    fields = sorted(model.model_fields.items(), key=lambda item: not item[1].is_required())
    return [f"| `{name}` | {_unit(info)} | {_default(info)} | {info.description} |" for name, info in fields]


def _unit(info: FieldInfo) -> str:
    extra = info.json_schema_extra
    return str(extra.get("unit") or "-") if isinstance(extra, dict) else "-"


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "required"
    value = info.default
    if value is None:
        return "see meaning"
    if isinstance(value, BaseModel | dict):
        return "-"
    if isinstance(value, tuple):
        return ", ".join(_item(item) for item in value) or "-"
    return describe(value).strip("'") or "-"


def _item(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_item, value))}]"
    return describe(value).strip("'")


if __name__ == "__main__":
    print(markdown(), end="")
