"""A rig file with a plant of the mock's family in place of its own (`hw.mock.family`)."""

from __future__ import annotations

from pydantic import ValidationError

from hw import registry
from hw.mock.family import FAMILY, merged, options_with
from hw.plain_words import explain
from rtctl.errors import ConfigError
from rtctl.rig_file.config import Config, LoadedConfig


def with_plant(loaded: LoadedConfig, name: str) -> LoadedConfig:
    """The simulated rig of `loaded` with plant `name`; its controller is told what must be true of that plant.

    Raises
    ------
    ConfigError
        There is no such plant, or the rig's device is not the mock, or the two do not go together.
    """
    if name not in FAMILY:
        raise ConfigError(f"no plant {name!r}; there are: {', '.join(FAMILY)}")
    if [device.kind for device in loaded.config.device] != ["mock"]:
        raise ConfigError(f"{loaded.path}: device[0].kind: only a mock alone can take plant {name!r}")
    plant, table = FAMILY[name], loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"] = [merged(axis, plant.told) for axis in table["axis"]]
    try:
        config = Config.model_validate(table)
        wanted = options_with(plant, loaded.options)
        options = registry.options_model("mock").model_validate(wanted, context={"n_axes": config.n_axes})
    except ValidationError as error:
        of_rig = error.title == Config.__name__
        told = (
            explain(error, Config, table)
            if of_rig
            else explain(error, registry.options_model("mock"), wanted)
        )
        faults = "; ".join(f"{one.where}: {one.text}" for one in told)
        raise ConfigError(f"{loaded.path}: plant {name!r} does not fit: {faults}") from error
    return loaded.model_copy(update={"config": config, "options": options.model_dump(mode="json")})
