"""``python -m data_prep corpus=NAME corpus.raw=RAW``: prepares a corpus; settings in ``conf/prepare.yaml``."""

import sys
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import Any

import hydra
from omegaconf import DictConfig, OmegaConf

from dnnvss.commands.entry import helped
from dnnvss.errors import DnnvssError

BUILT_IN = {"demo": "data_prep.demo.prepare_demo"}
"""Importers of corpora whose configuration names none."""


def run(config: DictConfig) -> None:
    """Prepare the corpus that a configuration describes.

    Raises:
        DnnvssError: a setting is missing, no importer is named, or what the importer raises.
    """
    missing = sorted(OmegaConf.missing_keys(config.corpus))
    if missing:
        raise DnnvssError(f"{missing[0]} is not set", remedy=f"Add {missing[0]}=... to the command")
    corpus: Any = OmegaConf.to_container(config.corpus, resolve=True)
    settings = corpus.get("importer") or {k: v for k, v in corpus.items() if k not in ("name", "raw", "out", "split")}
    target = settings.pop("_target_", None) or BUILT_IN.get(corpus["name"])
    if target is None:
        raise DnnvssError(f"corpus {corpus['name']!r} names no importer", remedy="Set corpus.importer._target_")
    module, function = target.rsplit(".", 1)
    settings |= {"raw": corpus.get("raw"), "out": corpus["out"]}
    prepare = getattr(import_module(module), function)
    common = {"jobs": config.jobs, "backend": config.backend, "strict": config.strict}
    known = signature(prepare).parameters
    prepare(**{k: v for k, v in {**common, **settings}.items() if v is not None and (k in known or k not in common)})


@hydra.main(version_base="1.3", config_path=str(Path(__file__).parent.parent / "conf"), config_name="prepare")
def main(config: DictConfig) -> None:
    """Prepare a corpus from the command line; a mistake in the input ends in one line that says what to do."""
    try:
        run(config)
    except DnnvssError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("Interrupted: the same command resumes where it stopped.")


if __name__ == "__main__":
    if not helped(Path(__file__).parent.parent / "conf", "prepare", sys.argv[1:]):
        main()
