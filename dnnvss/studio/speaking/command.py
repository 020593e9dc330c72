"""The command line that says the same as the page did."""

import shlex

from dnnvss.studio.speaking.saying import Saying
from dnnvss.synthesis.speak import Spoken

TAKEN = {"sound": "wav=speech.wav", "alignment": "alignment=speech.TextGrid", "keys": "import_keys=keys.csv"}
"""What of a take stands in a file of its own, and how ``synth.py`` is given that file."""


def command_line(saying: Saying, spoken: Spoken) -> str:
    """``python synth.py ...``, to be run beside the files that were taken away."""
    words = [f"run={spoken.run.folder}"]
    words += [f"text={saying.text}"] if saying.text else []
    words += [TAKEN["sound"]] if saying.sound else []
    words += [TAKEN["alignment"]] if saying.alignment else []
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
    return " ".join(["python synth.py", *map(shlex.quote, words)])
