"""The command lines that say, and write, the same as the page did."""

import shlex
from collections.abc import Iterable

from dnnvss.face.rig import RigFace
from dnnvss.runs.run import Run
from dnnvss.studio.speaking.saying import Saying
from dnnvss.synthesis.head import can_show_head
from dnnvss.synthesis.speak import Spoken

TAKEN = {"sound": "wav=speech.wav", "alignment": "alignment=speech.TextGrid", "keys": "import_keys=keys.csv"}
"""What of a take stands in a file of its own, and how the command is given that file."""


def command_line(saying: Saying, spoken: Spoken) -> str:
    """``dnnvss speak ...``, to be run beside the files that were taken away."""
    words = [f"run={spoken.run.folder}"]
    words += [f"text={saying.text}"] if saying.text else []
    words += [TAKEN["sound"]] if saying.sound else []
    words += [TAKEN["alignment"]] if saying.alignment or found_times(saying, spoken) else []
    words += [f"style={saying.style}"]
    for name in ("articulation", "closures", "contacts", "rest", "life", "seed"):
        if (value := getattr(saying, name)) is not None:
            words.append(f"style.{name}={str(value).lower()}")
    plain = {"speed": 1.0, "anticipation": 0.0, "rate": None}
    words += [f"{name}={getattr(saying, name):g}" if isinstance(default, float) else f"{name}={getattr(saying, name)}"
              for name, default in plain.items() if getattr(saying, name) != default]
    words += [f"speech={saying.engine}"] if saying.engine != "auto" and not saying.sound else []
    words += [f"render={saying.view}"] if saying.view != "face" else []
    words += [TAKEN["keys"]] if saying.keys else []
    words += ["overrides=words.txt"] if saying.pronunciations else []
    return " ".join(["dnnvss speak", *map(shlex.quote, words)])


def found_times(saying: Saying, spoken: Spoken) -> bool:
    """Whether phone times were found in a voice; in the sound that is taken away they may be found a frame beside."""
    return bool(saying.sound) and saying.alignment is None and spoken.plan.phones is not None


def rig_files(run: Run) -> dict[str, str]:
    """The takes for animators that a run's face allows: name of the file, and which curves stand in it."""
    named = {"plain.csv": "plain"}
    if isinstance(run.face, RigFace) or can_show_head(run):
        named["shapes.json"] = "arkit"
    if can_show_head(run):
        named |= {"livelink.csv": "arkit", "head.glb": "arkit"}
    return named


def measured_names(spoken: Spoken) -> list[str]:
    """What is measured for keys: the gauges of the face, or its first coefficients."""
    return list(spoken.run.face.gauges) or list(spoken.run.face.names[:3])


def export_lines(saying: Saying, spoken: Spoken, names: Iterable[str]) -> dict[str, str]:
    """The command line that writes a file, for those of the names that :func:`command_line` alone does not write."""
    line, exports = command_line(saying, spoken), {"curves.csv": "export_curves=curves.csv"}
    listed = ",".join(measured_names(spoken))
    exports["measured_keys.csv"] = f"export_keys=measured_keys.csv {shlex.quote(f'key_names=[{listed}]')}"
    for name, curves in rig_files(spoken.run).items():
        exports[name] = f"export_rig={name}" + (f" rig_curves={curves}" if curves != "arkit" else "")
    return {name: f"{line} {exports[name]}" for name in sorted(names) if name in exports}
