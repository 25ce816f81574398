"""What the scenario of a store says, read from the text that the store holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline.settings import Settings
from pipeline.strict_yaml import parse


def stated(attributes: Mapping[str, Any]) -> Settings:
    """Give the settings of the scenario that a store with these attributes holds."""
    return Settings.model_validate(parse(str(attributes["scenario"]), str(attributes["title"])).data)
