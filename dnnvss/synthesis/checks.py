"""What ``synth.py`` refuses before any work is done: no numbers, missing files, names that collide."""

from pathlib import Path

from omegaconf import DictConfig

from dnnvss.errors import DnnvssError

_NUMBERS = ("speed", "scale", "lead_in", "lead_out", "anticipation")
_LISTS = ("key_names", "key_positions")
_INPUTS = ("wav", "alignment", "import_keys", "overrides")
_OUTPUTS = ("export_curves", "export_keys", "export_alignment")
_ENDINGS = {"out": (".mp4", "export_curves=FILE.csv writes numbers"),
            "export_curves": (".csv", "the trajectory's .npz is written beside the video")}
"""Settings that name a file of one kind, and where other kinds are to be had."""


def beside(out: Path) -> list[Path]:
    """Return what is written beside every video: trajectory, alignment, plot and report."""
    return [out.with_suffix(suffix) for suffix in (".npz", ".TextGrid", ".png", ".json")]


def check_request(config: DictConfig) -> None:
    """Refuse settings of ``conf/synth.yaml`` that mean nothing, and names under which a file would be lost.

    Raises:
        DnnvssError: the first of them.
    """
    for setting in _NUMBERS:
        if isinstance(config[setting], bool | str) or config[setting] is None:
            raise DnnvssError(f"{setting}={config[setting]} is no number", remedy=f"Give a number: {setting}=1")
    for setting in _LISTS:
        if isinstance(config[setting], str | float | int):
            raise DnnvssError(f"{setting}={config[setting]} is no list", remedy=f"Write {setting}=[{config[setting]}]")
    if any(not 0 <= float(position) <= 1 for position in config.key_positions):
        raise DnnvssError(f"key_positions={list(config.key_positions)}", remedy="Give shares of a phone, 0 to 1")
    for setting in _INPUTS:
        if config[setting] and not Path(config[setting]).is_file():
            what = "is a folder" if Path(config[setting]).is_dir() else "no such file"
            raise DnnvssError(what, file=config[setting], remedy=f"Check the path given as {setting}=")
    for setting, (ending, other) in _ENDINGS.items():
        if config[setting] and Path(config[setting]).suffix.lower() != ending:
            raise DnnvssError(f"{setting}={config[setting]} does not end in {ending}", remedy=f"Name it so; {other}")
    _check_places(config)


def _check_places(config: DictConfig) -> None:
    """Refuse an output that is an input, links followed, or another output."""
    out = Path(config.out)
    written = [out, *beside(out), *(Path(config[s]) for s in _OUTPUTS if config[s])]
    if config.wav or config.speech.engine != "none":
        written.append(out.with_suffix(".wav"))
    read = [Path(config[s]) for s in _INPUTS if config[s]]
    if config.into:
        read += [Path(config.into), Path(config.into).with_suffix(".npz")]
    places = [path.resolve() for path in written]
    for path in read:
        if path.resolve() in places:
            raise DnnvssError(f"out={out} would overwrite what is read", file=path, remedy="Choose another out=")
    for place in places:
        if places.count(place) > 1:
            raise DnnvssError("two outputs have this name", file=place, remedy="Name one of them otherwise")
