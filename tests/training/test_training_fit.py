"""The fit: it learns, resumes to the same weights, stops on divergence, and refuses damaged checkpoints."""

import errno
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, of_layers

from dnnvss.errors import DnnvssError
from dnnvss.systems import Example
from dnnvss.systems.base import NoSettings
from dnnvss.systems.frame_network import FrameNetwork
from dnnvss.systems.network import NetworkModel
from dnnvss.training import FitSettings
from dnnvss.training.checkpoints import load_checkpoint
from dnnvss.training.devices import process_number
from dnnvss.training.module import FitModule
from dnnvss.training.regression import FrameRegression

SETTINGS = FitSettings(epochs=4, batch_size=32, learning_rate=3e-3, progress=False, figure_every=0, accelerator="cpu",
                       schedule="constant")


def network(settings: FitSettings = SETTINGS) -> NetworkModel:
    return NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16, dropout=0.2), settings))


def weights(model: NetworkModel) -> np.ndarray:
    return np.concatenate([v.ravel() for v in model.state()["networks"][0].values()])


def test_resumed_fit_ends_with_the_weights_of_an_uninterrupted_one(examples: dict[str, list[Example]],
                                                                  tmp_path: Path) -> None:
    whole = network()
    whole.fit(examples["train"], examples["val"], tmp_path / "whole")
    network(replace(SETTINGS, epochs=2)).fit(examples["train"], examples["val"], tmp_path / "cut")
    resumed = network()
    resumed.fit(examples["train"], examples["val"], tmp_path / "cut")
    np.testing.assert_array_equal(weights(resumed), weights(whole))


def test_training_loss_falls_and_validation_is_logged(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    short, long = network(replace(SETTINGS, epochs=1)), network(replace(SETTINGS, epochs=12))
    errors = []
    for name, model in (("short", short), ("long", long)):
        model.fit(examples["train"], examples["val"], tmp_path / name)
        errors.append(np.mean([np.mean((model.predict(e).mean - e.targets) ** 2) for e in examples["val"]]))
    assert errors[1] < 0.7 * errors[0]
    assert list((tmp_path / "long" / "tensorboard").glob("events*"))


def test_members_are_the_networks_of_their_seeds_and_the_prediction_is_their_mean(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    short = replace(SETTINGS, epochs=1)
    alone = [network(replace(short, seed=k)) for k in (0, 1)]
    for k, model in enumerate(alone):
        model.fit(examples["train"], examples["val"], tmp_path / f"alone{k}")
    both = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16, dropout=0.2), short, members=2))
    both.fit(examples["train"], examples["val"], tmp_path / "both")
    expected = np.mean([m.predict(examples["test"][0]).mean for m in alone], axis=0)
    np.testing.assert_allclose(both.predict(examples["test"][0]).mean, expected, atol=1e-5)
    with pytest.raises(DnnvssError, match="members=0"):
        NetworkModel.Settings(of_layers(16), short, members=0)


def test_divergence_names_rate_reduction_and_batch(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    wild = replace(SETTINGS, optimizer="sgd", learning_rate=1e30, reduction="sum", clip=1e30, epochs=3)
    with pytest.raises(DnnvssError, match=r"learning rate 1e\+30 .*reduction 'sum'.*batch size 32") as caught:
        network(wild).fit(examples["train"], examples["val"], tmp_path)
    assert "Lower trainer.learning_rate" in str(caught.value)


def test_a_full_disk_leaves_the_checkpoint_of_before(examples: dict[str, list[Example]], tmp_path: Path,
                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    network(replace(SETTINGS, epochs=2)).fit(examples["train"], examples["val"], tmp_path)
    before = (tmp_path / "checkpoints" / "last.ckpt").read_bytes()

    def full(self: Path, data: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(DnnvssError, match=r"ckpt: cannot be written \(No space left on device\)"):
        network().fit(examples["train"], examples["val"], tmp_path)
    assert (tmp_path / "checkpoints" / "last.ckpt").read_bytes() == before
    assert not list(tmp_path.rglob("*.part*"))


def test_ctrl_c_in_the_fit_is_ctrl_c_for_the_caller(examples: dict[str, list[Example]], tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: FitModule, *batch: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(FitModule, "training_step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            network().fit(examples["train"], examples["val"], tmp_path / "cut")
    resumed, whole = network(), network()
    resumed.fit(examples["train"], examples["val"], tmp_path / "cut")
    whole.fit(examples["train"], examples["val"], tmp_path / "whole")
    np.testing.assert_array_equal(weights(resumed), weights(whole))


def test_a_damaged_checkpoint_is_left_for_an_earlier_one_that_leads_to_the_same_weights(
        examples: dict[str, list[Example]], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = network()
    whole.fit(examples["train"], examples["val"], tmp_path / "whole")
    network(replace(SETTINGS, epochs=2)).fit(examples["train"], examples["val"], tmp_path / "cut")
    last, best = (tmp_path / "cut" / "checkpoints" / f"{name}.ckpt" for name in ("last", "best"))
    last.write_bytes(last.read_bytes()[:1000])
    resumed = network()
    resumed.fit(examples["train"], examples["val"], tmp_path / "cut")
    assert "last.ckpt is damaged: the fit goes on from best.ckpt" in capsys.readouterr().out
    np.testing.assert_array_equal(weights(resumed), weights(whole))
    for path in (last, best):
        path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(DnnvssError, match=r"last.ckpt: cannot be read"):
        network().fit(examples["train"], examples["val"], tmp_path / "cut")


def test_a_fit_that_has_ended_is_not_taken_up_again(examples: dict[str, list[Example]], tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither one that ran to its last epoch nor one that stopped early, however often it is called."""
    begun: list[int] = []
    begin = FitModule.on_train_epoch_start

    def counted(self: FitModule) -> None:
        begun.append(self.current_epoch)
        begin(self)

    monkeypatch.setattr(FitModule, "on_train_epoch_start", counted)
    hasty = replace(SETTINGS, learning_rate=0.3, batch_size=16, epochs=30, patience=2)
    for name, settings in (("ended", replace(hasty, epochs=8, patience=30)), ("stopped", hasty)):
        models = []
        for _ in range(3):
            models.append(network(settings))
            models[-1].fit(examples["train"], examples["val"], tmp_path / name)
        assert len(begun) == len(set(begun)) < 30
        kept = {k: load_checkpoint(tmp_path / name / "checkpoints" / f"{k}.ckpt")["epoch"] for k in ("last", "best")}
        assert kept["last"] == begun[-1] > kept["best"]
        for other in models[1:]:
            np.testing.assert_array_equal(weights(other), weights(models[0]))
        begun.clear()


def test_a_run_folder_that_was_moved_resumes_to_the_same_weights(examples: dict[str, list[Example]],
                                                                 tmp_path: Path) -> None:
    """Also where the best epoch lies before the move."""
    hasty = replace(SETTINGS, learning_rate=0.3, batch_size=16, epochs=10, patience=30, warmup=0)
    whole, resumed = network(hasty), network(hasty)
    whole.fit(examples["train"], examples["val"], tmp_path / "whole")
    best = load_checkpoint(tmp_path / "whole" / "checkpoints" / "best.ckpt")["epoch"]
    assert best < 9
    network(replace(hasty, epochs=best + 1)).fit(examples["train"], examples["val"], tmp_path / "here")
    (tmp_path / "here").rename(tmp_path / "there")
    resumed.fit(examples["train"], examples["val"], tmp_path / "there")
    np.testing.assert_array_equal(weights(resumed), weights(whole))


def test_the_average_keeps_no_history(examples: dict[str, list[Example]], tmp_path: Path,
                                      monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[bool] = []
    end = FitModule.on_train_epoch_end

    def looked(self: FitModule) -> None:
        assert self.average is not None
        seen.extend(p.requires_grad for p in self.average.parameters())
        end(self)

    monkeypatch.setattr(FitModule, "on_train_epoch_end", looked)
    network(replace(SETTINGS, epochs=1, average=0.9)).fit(examples["train"], examples["val"], tmp_path)
    assert seen and not any(seen)


def test_a_prediction_is_made_without_dropout_and_leaves_every_member_as_it_was(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, dropout=0.5), replace(SETTINGS, epochs=1),
                                                             members=2))
    model.fit(examples["train"], examples["val"], tmp_path)
    model.networks_[0].train()
    with torch.inference_mode():
        first, second = (model.predict(examples["test"][0]).mean for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert [n.training for n in model.networks_] == [True, False]


def test_a_coefficient_that_stands_still_in_training_does_not_rule_the_error(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    def still(example: Example, value: float) -> Example:
        targets = example.targets.copy()
        targets[:, 0, -1], targets[:, 1:, -1] = value, 0.0
        return replace(example, targets=targets)

    model = network(replace(SETTINGS, epochs=1))
    model.fit([still(e, 1.0) for e in examples["train"]], [still(e, 1.0001) for e in examples["val"]], tmp_path)
    assert (model.deviation_[:, -1] > 1e-5 * model.deviation_[:, 0]).all()


@pytest.mark.parametrize("told, number", [({}, 0), ({"LOCAL_RANK": "1"}, 1), ({"NODE_RANK": "1"}, 1),
                                          ({"NODE_RANK": "0", "LOCAL_RANK": "0"}, 0), ({"RANK": "0"}, 0),
                                          ({"RANK": "3", "LOCAL_RANK": "0"}, 3), ({"SLURM_PROCID": "2"}, 2)])
def test_one_process_alone_is_the_first(told: dict[str, str], number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("RANK", "SLURM_PROCID", "LOCAL_RANK", "NODE_RANK", "GROUP_RANK"):
        monkeypatch.delenv(name, raising=False)
    for name, value in told.items():
        monkeypatch.setenv(name, value)
    assert process_number() == number


@pytest.mark.slow
def test_a_fit_killed_at_any_moment_ends_as_one_that_was_not(tmp_path: Path) -> None:
    """In the first epoch, in a later one, in a refinement, in fits of visemes and over time, with half a checkpoint
    written, between the best and the last.
    """
    program([Path(__file__).with_name("killed_fit.py"), tmp_path])
    results = {path.parent.name: np.load(path) for path in tmp_path.glob("*/result.npz")}
    whole = results.pop("whole")
    assert len(results) == 7
    for name, result in results.items():
        for part in ("weights", "variance", "units", "over_time"):
            np.testing.assert_array_equal(result[part], whole[part], err_msg=f"{name}: {part}")


@pytest.mark.slow
def test_two_processes_share_every_batch_and_end_with_the_weights_of_one(tmp_path: Path) -> None:
    for devices in (1, 2):
        (tmp_path / str(devices)).mkdir()
        program([Path(__file__).with_name("shared_fit.py"), tmp_path / str(devices), devices])
    drawn = [[int(i) for i in path.read_text().split()] for path in sorted(tmp_path.glob("*/drawn*.txt"))]
    alone, *shared = drawn
    assert len(shared) == 2 and sorted(shared[0] + shared[1]) == sorted(alone)  # no frame lost, none drawn twice
    epoch = len(alone) // 2
    assert len(set(alone[:epoch])) == epoch and not set(shared[0][: epoch // 2]) & set(shared[1][: epoch // 2])
    one, two = (np.load(tmp_path / name / "weights.npy") for name in "12")
    np.testing.assert_allclose(two, one, atol=2e-5)
    one, two = (np.load(tmp_path / name / "variance.npy") for name in "12")
    np.testing.assert_allclose(two, one, rtol=1e-3)


@pytest.mark.slow
def test_processes_end_together_if_one_of_them_diverges(tmp_path: Path) -> None:
    said = program([Path(__file__).with_name("shared_fit.py"), tmp_path, 2, "spoilt"], expected=1)
    for number in range(2):
        assert f"process {number}: training diverged: the loss of batch 0 in epoch 0" in said, said[-3000:]
    assert not (tmp_path / "checkpoints").exists()


def program(arguments: list[object], expected: int = 0) -> str:
    """Run a program of the tests and return what it says on standard error."""
    done = subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, text=True, check=False,
                          env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert done.returncode == expected, done.stderr[-3000:]
    return done.stderr


def test_a_batch_that_processes_cannot_share_evenly_is_refused(examples: dict[str, list[Example]],
                                                               tmp_path: Path) -> None:
    odd = replace(SETTINGS, batch_size=33, devices=2, strategy="ddp_spawn")
    with pytest.raises(DnnvssError, match="33 frames cannot be shared by 2 processes"):
        network(odd).fit(examples["train"], examples["val"], tmp_path)


def test_a_validation_error_that_explodes_ends_the_fit_and_keeps_the_last_good_checkpoint(
        examples: dict[str, list[Example]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calm = replace(SETTINGS, epochs=1, optimizer="sgd", reduction="sum", clip=1e9, learning_rate=1e-4)
    network(calm).fit(examples["train"], examples["val"], tmp_path)
    before = (tmp_path / "checkpoints" / "last.ckpt").read_bytes()
    monkeypatch.setattr(FrameRegression, "most", 1e-3)  # an explosion, in place of one that is waited for
    with pytest.raises(DnnvssError, match=r"static error on validation after epoch 1 is .*learning rate 0\.0001 \(sgd, "
                                          r"reduction 'sum', batch size 32\)"):
        network(replace(calm, epochs=2)).fit(examples["train"], examples["val"], tmp_path)
    assert (tmp_path / "checkpoints" / "last.ckpt").read_bytes() == before


@pytest.mark.parametrize("given", [{"accelerator": "gpu"}, {"accelerator": "gpuu"}, {"devices": 0}, {"devices": -1},
                                   {"strategy": "dpp"}])
def test_devices_that_are_not_there_are_named(given: dict[str, Any], examples: dict[str, list[Example]], tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 0)
    model = network(replace(SETTINGS, **given))
    name, value = next(iter(given.items()))
    with pytest.raises(DnnvssError, match=rf"trainer\.{name}={value}.*trainer\.accelerator=auto"):
        model.fit(examples["train"], examples["val"], tmp_path)


def test_invalid_frames_are_never_drawn(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    spoilt = [replace(e, targets=e.targets.copy(), valid=e.valid.copy()) for e in examples["train"]]
    for e in spoilt:
        e.valid[:5] = False
    clean = network()
    clean.fit(spoilt, examples["val"], tmp_path / "clean")
    for e in spoilt:
        e.targets[:5] = 1e6
    ghosts = network()
    ghosts.fit(spoilt, examples["val"], tmp_path / "ghosts")
    np.testing.assert_array_equal(weights(ghosts), weights(clean))


def test_checkpoint_holds_plain_containers(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    network(replace(SETTINGS, epochs=1)).fit(examples["train"], examples["val"], tmp_path)
    assert "state_dict" in load_checkpoint(tmp_path / "checkpoints" / "last.ckpt")


@pytest.mark.parametrize("wrong", [
    {"optimizer": "lbfgs"}, {"learning_rate": 0.0}, {"reduction": "none"}, {"share": 1.5}, {"average": 1.0},
    {"average": -0.1}, {"warmup": 5.0}, {"patience": -1}, {"figure_every": -1}, {"momentum": 1.0},
])
def test_settings_refuse_nonsense(wrong: dict) -> None:
    with pytest.raises(DnnvssError, match=f"trainer.{next(iter(wrong))}"):
        FitSettings(**wrong)


@pytest.mark.parametrize("wanted", [{}, {"optimizer": "sgd", "learning_rate": 0.1, "clip": 0.2}])
def test_members_trained_together_are_those_trained_apart(wanted: dict, examples: dict[str, list[Example]],
                                                          tmp_path: Path) -> None:
    """Weights, batches and clipping of each member are its own."""
    apart = replace(SETTINGS, epochs=2, **wanted)
    models = [NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16), settings, members=3))
              for settings in (apart, replace(apart, together=True))]
    for name, model in zip(("apart", "together"), models, strict=True):
        model.fit(examples["train"], examples["val"], tmp_path / name)
    for one, other in zip(*(model.networks_ for model in models), strict=True):
        for key, value in one.state_dict().items():
            np.testing.assert_allclose(other.state_dict()[key], value, atol=2e-5, err_msg=key)
    np.testing.assert_allclose(models[1].variance_, models[0].variance_, rtol=1e-3)


def test_only_feed_forward_networks_are_trained_together(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    class Other(FrameNetwork):
        """A network of another kind."""

        kind, Settings = "other", NoSettings

        def __init__(self, binary: int, numeric: int, active: int, out: int) -> None:
            super().__init__()

    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings({"kind": "other"}, replace(SETTINGS, together=True), 2))
    with pytest.raises(DnnvssError, match=r"trainer\.together"):
        model.fit(examples["train"], examples["val"], tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("g++") is None, reason="torch.compile needs a C++ compiler (g++)")
@pytest.mark.filterwarnings("ignore")  # of the compiler
def test_compiled_steps_are_those_that_are_not(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    """Without dropout, whose masks a compiled network draws for itself."""
    found = []
    for wanted in (False, True):
        model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16),
                                                                 replace(SETTINGS, epochs=2, compile=wanted)))
        model.fit(examples["train"], examples["val"], tmp_path / str(wanted))
        found.append(weights(model))
    np.testing.assert_allclose(found[1], found[0], atol=1e-4)
