"""Designs, lists, answers and what is made of them: each answer taken or refused by name, and no script runs."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import run_command
from viewing_cases import CONF, design, plain, sheet_of, simulated

from dnnvss import files
from dnnvss.commands.viewing import read_design
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.analysis import analyse
from dnnvss.evaluation.viewing.answers import MOST, Answer, Received, Row, answer_files, receive
from dnnvss.evaluation.viewing.design import Condition, conditions_of
from dnnvss.evaluation.viewing.judgements import Judgements, judgements, told
from dnnvss.evaluation.viewing.lists import ORDERS, cells_of, check_places, list_count, ordered
from dnnvss.evaluation.viewing.making import script_json
from dnnvss.evaluation.viewing.report import html_page, markdown, write_report
from dnnvss.evaluation.viewing.run_scores import leave_scores, note_test, read_scores
from dnnvss.evaluation.viewing.sheet import CHANGED, KEY, Sheet, Shown
from dnnvss.evaluation.viewing.sounds import cut, in_noise, speech_power
from dnnvss.runs.files import RunFiles
from dnnvss.studio.viewing import least_given

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>|\n# \u2028"
QUALITY = {"good": 1.0, "bad": -1.0, "through": 1.5, "smoothed": 0.0, "random": -2.0, "frozen": -3.0}


@pytest.mark.parametrize("name", sorted(path.stem for path in CONF.glob("*.yaml")))
def test_every_design_is_laid_out_answered_and_analysed(name: str, tmp_path: Path) -> None:
    sheet = sheet_of(design(name, sentences=6, per_viewer=6))
    sheet.save(tmp_path)
    assert Sheet.open(tmp_path) == sheet and "good" not in json.dumps(sheet.public())
    sent = [(f"{n}.json", _bytes(plain(simulated(sheet, n, QUALITY)))) for n in range(16)]
    received = receive(sheet, sent)
    assert received.refused == {} and len(received.answers) == 16
    result = analyse(sheet, received)
    better, worse = ("through", "frozen") if name == "intelligibility" else ("good", "bad")
    if name != "dscqs":
        assert result.scores[better].low > result.scores[worse].value
    else:
        assert result.scores["smoothed"].high < 0
    written = write_report(result, tmp_path)
    page = written.page.read_text()
    assert result.tables[-1].title == "Agreement of viewers" and float(result.tables[-1].rows[0][0]) > 0
    assert "<script" not in page and "script-src 'none'" in page and len(result.tables) >= 2
    assert json.loads(written.data.read_text())["scores"].keys() == result.scores.keys()


def _bytes(value: Any) -> bytes:
    return json.dumps(value).encode()


@pytest.mark.parametrize(("every", "ways", "treatments"), [(False, 2, 6), (True, 2, 6), (False, 1, 3), (True, 1, 5)])
def test_all_lists_together_show_every_cell_equally_often(every: bool, ways: int, treatments: int) -> None:
    shape = (10, 4, treatments, every, ways)
    lists = [cells_of(k, *shape) for k in range(list_count(*shape))]
    seen = Counter(cell for row in lists for cell in row)
    assert len(seen) == 10 * treatments and len(set(seen.values())) == 1
    for row in lists:
        assert len({s for s, _ in row}) == 4 and len(row) == (4 * treatments // ways if every else 4)
        order = ordered(row, 0, 1)
        assert sorted(order) == sorted(row)
        assert all(a != b for (a, _), (b, _) in zip(order[1:], order, strict=False))
    assert len({tuple(ordered(lists[0], 0, k)) for k in range(5)}) > 1


def test_viewers_who_see_all_see_it_in_orders_of_their_own() -> None:
    sheet = sheet_of(design("single", checks=0))
    assert len(sheet.lists) == len(set(sheet.lists)) == ORDERS and len({row[0] for row in sheet.lists}) > 8
    assert {tuple(sorted(row)) for row in sheet.lists} == {tuple(range(16))}


def test_the_server_hands_out_every_list_equally_often() -> None:
    done, out = dict[str, int](), dict[str, int]()
    for viewer in range(23):
        out[str(viewer)] = least_given(5, done, out)
        if viewer % 3:
            done[str(viewer)] = out.pop(str(viewer))
    given = Counter([*done.values(), *out.values()])
    assert max(given.values()) - min(given.values()) <= 1


def test_checks_stand_apart_and_never_first() -> None:
    for number in range(50):
        places = check_places(20, 3, 0, number)
        assert places[0] >= 1 and places == sorted(places) and places[-1] < 20


def test_designs_that_contradict_themselves_are_refused() -> None:
    made = design("preference")
    with pytest.raises(DnnvssError, match="two conditions at least"):
        conditions_of(made, ["one"])
    with pytest.raises(DnnvssError, match="shows run 3"):
        conditions_of(replace(made, conditions=(Condition("a"), Condition("b", run=3))), ["x", "y"])
    with pytest.raises(DnnvssError, match="cannot have an engine's voice"):
        conditions_of(replace(made, sound="engine", anchors=("through",)), ["x", "y"])
    with pytest.raises(DnnvssError, match="one sound"):
        conditions_of(replace(made, conditions=(Condition("a"), Condition("b", sound="silent"))), ["x"])
    for twice in (("a", "a"), ("a", " "), ("a", "x", "x")):
        with pytest.raises(DnnvssError, match="one name"):
            conditions_of(replace(made, conditions=tuple(map(Condition, twice))), ["x"])
    with pytest.raises(DnnvssError, match="one name"):
        conditions_of(replace(made, anchors=("frozen", "frozen")), ["x"])
    with pytest.raises(DnnvssError, match="the run y is shown by no condition"):
        conditions_of(design("dscqs"), ["x", "y"])
    for change in ({"per_viewer": 9}, {"kind": "dscqs"}, {"kind": "intelligibility"}):
        with pytest.raises(DnnvssError):
            replace(made, **change)
    with pytest.raises(DnnvssError, match="labels has 2 texts, and there are 3 buttons"):
        replace(made, tie=True, labels=("Left", "Right"))
    with pytest.raises(DnnvssError, match="alternatives=6 are more"):
        replace(design("intelligibility"), alternatives=6)
    for idle in ({"dials": {"articulation": 2}}, {"style": "own"}, {"smooth": 6.0}):
        with pytest.raises(DnnvssError, match="changes nothing of the condition still"):
            Condition("still", "frozen", **idle)


def _damaged(answer: dict[str, Any], sheet: Sheet) -> dict[str, bytes]:
    """Every kind of bad answer by what is said of it."""
    def changed(**more: Any) -> bytes:
        return _bytes({**answer, **more})

    rows = answer["rows"]
    deep = b"[" * 100_000
    return {
        "cut off": _bytes(answer)[:-40], "is no JSON": b"\xff\xfe\x00", "nested too deeply": deep,
        "is longer than": b" " * (MOST + 1), "is no table": b"[]", "of the test": changed(test="other"),
        "no number that the page": changed(viewer="../../../etc/passwd"), "there are": changed(list=10**6),
        "rows": changed(rows="none"), "is no setting": changed(evil=EVIL), "answers 5 trials": changed(rows=rows[:-1]),
        "not the": changed(rows=[*rows[:-1], rows[0]]), "ends before": changed(ended=1.0),
        "NaN": _bytes(answer).replace(b"1000.0", b"NaN"), "other stimuli": changed(
            rows=[{**rows[0], "stimuli": rows[1]["stimuli"]}, *rows[1:]]),
        "another seed": changed(rows=[{**r, "stimuli": [{**s, "seed": 99} for s in r["stimuli"]]} for r in rows]),
        "holds no choice": changed(rows=[{**rows[0], "choice": EVIL}, *rows[1:]]),
        "a text of more than": changed(comment="x" * 5000), "others were asked": changed(questions=["a"]),
        "too much": changed(rows=[{**rows[0], "seconds": 1e300}, *rows[1:]]),
        "is no": changed(rows=[{**rows[0], "trial": {"a": 1}}, *rows[1:]]),
    }


def _crowd(sheet: Sheet, count: int) -> tuple[list[tuple[str, bytes]], int, int]:
    """Answers of so many viewers, a tenth of them damaged in every way, copies and second answers among them."""
    bad = list(_damaged(plain(simulated(sheet, 0, QUALITY)), sheet).values())
    sent, good, wrong = list[tuple[str, bytes]](), 0, 0
    for n in range(count):
        if n % 10 == 3:
            sent.append((f"{n}-{EVIL[:20]}.json", bad[(n // 10) % len(bad)]))
            wrong += 1
        elif n % 50 == 7:
            sent.append((f"{n}.json", sent[n - 1][1]))
            wrong += 1
        else:
            answer = {**plain(simulated(sheet, n, QUALITY, careless=n % 20 == 0)), "comment": EVIL}
            sent.append((f"{n}.json", _bytes(answer)))
            good += 1
    return sent, good, wrong


def test_damaged_answers_are_refused_by_name() -> None:
    sheet = sheet_of(design("preference"))
    answer = plain(simulated(sheet, 1, QUALITY))
    assert len(answer["rows"]) == 5
    for problem, data in _damaged(answer, sheet).items():
        problem = problem.replace("answers 5", "answers 4")
        received = receive(sheet, [("it", data)])
        assert received.answers == {} and problem in received.refused["it"], (problem, received.refused)
    later = {**answer, "ended": 3000.0}
    received = receive(sheet, [("later", _bytes(later)), ("a", _bytes(answer)), ("b", _bytes(answer))])
    assert list(received.answers) == ["a"]
    assert received.refused == {"b": "is a copy of a", "later": "is by the viewer of a, later"}
    with pytest.raises(DnnvssError, match="no answer counts"):
        analyse(sheet, Received({}, {"x": "is bad"}))


@pytest.mark.parametrize("name, encoding", [
    ("a.json", "utf-8-sig"), ("b.JSON", "utf-16"), ("c.json.txt", "utf-8"), ("d (1).json", "utf-16-be"),
    ("e.txt", "utf-8")])
def test_answers_that_went_through_mail_and_editors_are_taken(tmp_path: Path, name: str, encoding: str) -> None:
    sheet = sheet_of(design("preference"))
    text = json.dumps(plain(simulated(sheet, 1, QUALITY)), indent=1).replace("\n", "\r\n")
    (tmp_path / name).write_bytes(text.encode(encoding))
    (tmp_path / "readme.txt").write_text("three viewers")
    received = receive(sheet, answer_files(tmp_path))
    assert list(received.answers) == [name] and "is no JSON" in received.refused["readme.txt"]


def test_no_script_of_an_answer_runs_in_the_page() -> None:
    sheet = sheet_of(design("preference", title=EVIL))
    sent, good, wrong = _crowd(sheet, 100)
    received = receive(sheet, sent)
    assert (len(received.answers), len(received.refused)) == (good, wrong)
    result = analyse(sheet, received)
    assert result.left_out and all("attention checks" in why for why in result.left_out.values())
    page, text = html_page(result), markdown(result)
    assert page.count("<script") == page.count("<img") == 0 and "&lt;script" in page
    assert "<script" not in text and "\n# \u2028" not in text
    assert "<" not in script_json({"text": EVIL}) and "\u2028" not in script_json({"text": EVIL})


@pytest.mark.slow
def test_ten_thousand_answers_are_each_taken_or_refused() -> None:
    sheet = sheet_of(design("preference"))
    sent, good, wrong = _crowd(sheet, 10_000)
    received = receive(sheet, sent)
    assert (len(received.answers), len(received.refused)) == (good, wrong)
    assert {name for name, _ in sent} == {*received.answers, *received.refused}
    result = analyse(sheet, received)
    assert result.scores["good"].low > 0.85 and "<script" not in html_page(result)


def test_a_word_counts_as_it_sounds() -> None:
    assert told("Red ", "red") and told("read", "red") and told("be", "bee") and not told("bed", "red")
    assert not told("", "red") and not told("<b>", "red")


def test_words_are_cut_and_put_into_noise_of_a_level() -> None:
    rng = np.random.default_rng(0)
    speech = np.concatenate([np.zeros(8000), rng.normal(0, 0.05, 8000)]).astype(np.float32)
    noisy = in_noise(speech, 16000, -6.0, (0, 1))
    noise = noisy - speech
    assert 10 * np.log10(speech_power(speech, 16000) / (noise ** 2).mean()) == pytest.approx(-6, abs=0.1)
    assert (in_noise(speech, 16000, -6.0, (0, 1)) == noisy).all()
    part = cut(speech, 16000, 0.9, 0.3, fade=True)
    assert len(part) == 4800 and part[0] == 0 and part[-1] == 0
    assert part[1000:3200] == pytest.approx(speech[15400:][:600].tolist() + [0.0] * 1600)


def test_judgements_are_those_of_the_answers_and_checks_are_none() -> None:
    sheet = sheet_of(design("dscqs"))
    answer = simulated(sheet, 0, QUALITY)
    judged = judgements(sheet, {"a": answer})
    assert len(judged.value) == 4 and len(answer.rows) == 5
    what = {s.id: s.condition for s in sheet.stimuli}
    row = next(r for r in answer.rows if sheet.trials[r.trial].expect is None)
    assert judged.condition[0].tolist() == [what[s.id] for s in row.stimuli]
    assert judged.value[0].tolist() == list(row.scores)
    assert len(judged.single().value) == 8


def test_pairs_with_a_reference_are_scores_less_that_of_the_reference() -> None:
    made = Judgements(np.array([0, 0, 1]), np.array([0, 1, 0]), np.array([[1, 0], [1, 2], [2, 1]]),
                      np.array([[80.0, 30.0], [70.0, 75.0], [20.0, 90.0]]), ("a", "b"))
    found = made.less(1)
    assert found.condition.tolist() == [0, 1, 1] and found.value.tolist() == [-50.0, 5.0, -70.0]
    assert found.viewer.tolist() == [0, 0, 1] and found.sentence.tolist() == [0, 1, 0]


def test_the_order_in_which_the_page_has_the_stimuli_says_nothing() -> None:
    sheet = sheet_of(design("single"))
    kept = sheet.stimuli
    turned = replace(sheet, stimuli=tuple(replace(s, id=kept[-k - 1].id) for k, s in enumerate(kept)))
    told = [s["id"] for s in turned.public()["stimuli"]]
    assert told == sorted(told) and told != [s.id for s in turned.stimuli]


def test_anchors_are_left_out_whatever_their_names() -> None:
    shows = (("mine", "run"), ("still, or frozen", "frozen"), ("yours", "run"), ("as filmed", "recording"))
    made = tuple(Condition(name, kind, run=1 + (name == "yours")) for name, kind in shows)
    sheet = sheet_of(design("single", checks=0, anchors=(), conditions=made), ("x", "y"))
    sheet = replace(sheet, conditions=tuple(replace(s, shows=kind) for s, (_, kind) in
                                            zip(sheet.conditions, shows, strict=True)))
    quality = {name: float(k) for k, (name, _) in enumerate(shows)}
    result = analyse(sheet, Received({str(k): simulated(sheet, k, quality) for k in range(6)}, {}))
    tables = {table.title: [row[0] for row in table.rows] for table in result.tables}
    assert tables["Kruskal-Wallis without still, or frozen"] == ["mine", "yours", "as filmed"]
    assert tables["Kruskal-Wallis without still, or frozen, as filmed"] == ["mine", "yours"]


def test_where_viewers_rate_several_beside_a_reference_tests_know_that() -> None:
    reference = str(design("dscqs").reference)
    three = (Condition(reference, "recording"), Condition("near"), Condition("far", run=2))
    sheet = sheet_of(design("dscqs", sentences=6, per_viewer=6, checks=0, conditions=three), ("x", "y"))
    quality = {reference: 1.0, "near": 0.8, "far": -1.0}
    result = analyse(sheet, Received({str(k): simulated(sheet, k, quality) for k in range(12)}, {}))
    tables = {table.title: table for table in result.tables}
    assert tables["Friedman"].rows[0][0] == "12" and tables["Friedman"].rows[0][2] == "1"
    assert [row[:2] for row in tables["Differences in score (mixed model)"].rows] == [("near", "far")]
    assert result.scores["near"].value > result.scores["far"].value



@pytest.mark.parametrize("name", ["preference", "dscqs", "single", "turing", "intelligibility"])
@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.filterwarnings("error")
def test_few_viewers_who_all_say_the_same_are_no_certainty(name: str, count: int) -> None:
    for per_viewer in (1, 4):
        sheet = sheet_of(design(name, per_viewer=per_viewer))
        answers = {str(k): _alike(sheet, simulated(sheet, k, QUALITY)) for k in range(count)}
        result = analyse(sheet, Received(answers, {}))
        assert all(np.isfinite(s.value) and np.isnan(s.low) for s in result.scores.values())
        assert count < 2 or any(warning.startswith("No interval for") for warning in result.warnings)
        cells = [cell for table in result.tables for row in table.rows for cell in row]
        assert "< .0001" not in cells and "nan" not in html_page(result) + markdown(result)


def test_viewers_who_all_prefer_one_agree() -> None:
    sheet = sheet_of(design("preference", sentences=12, per_viewer=12, checks=0))
    answers = {str(k): _alike(sheet, simulated(sheet, k, QUALITY)) for k in range(4)}
    other = {"left": "right", "right": "left"}
    turned = replace(answers["0"], rows=tuple(replace(row, choice=other[str(row.choice)]) for row in answers["0"].rows))
    for given, agreed in ((answers, 1.0), ({**answers, "0": turned}, 1 / 96)):  # three of six pairs of viewers agree
        cell, = analyse(sheet, Received(given, {})).tables[-1].rows[0]
        assert float(cell) == pytest.approx(agreed, abs=0.001)


def test_pairs_that_did_not_begin_together_are_told() -> None:
    sheet = sheet_of(design("preference"))
    answer = simulated(sheet, 0, QUALITY)
    for apart, said in ((39.0, False), (-41.0, True)):  # of 40 ms a picture
        rows = (replace(answer.rows[0], apart=apart), *answer.rows[1:])
        warnings = analyse(sheet, Received({"a": replace(answer, rows=rows)}, {})).warnings
        assert any(w.startswith("1 of 1 pairs began more than a picture apart") for w in warnings) == said


def _alike(sheet: Sheet, answer: Answer) -> Answer:
    """An answer in which nothing differs, attention checks apart."""
    first = {s.id: s.condition for s in sheet.stimuli}

    def row(given: Row) -> Row:
        trial = sheet.trials[given.trial]
        if trial.expect is not None:
            return given
        if given.scores:
            return replace(given, scores=tuple(50.0 for _ in given.scores))
        if given.word is not None:
            return replace(given, word=sheet.words[{s.id: s.sentence for s in sheet.stimuli}[trial.stimuli[0]]])
        ahead = len(trial.stimuli) == 1 or first[trial.stimuli[0]] < first[trial.stimuli[1]]
        names = ("real", "synthetic") if sheet.design["kind"] == "turing" else ("left", "right")
        return replace(given, choice=names[0 if ahead else 1])

    return replace(answer, rows=tuple(map(row, answer.rows)))


def test_a_score_is_left_in_the_run_that_was_seen_and_only_as_it_is_measured(tmp_path: Path) -> None:
    places = RunFiles(tmp_path / "run")
    files.write_text(places.model, "learnt")
    digest = files.digest(places.model)[:16]
    sheet = sheet_of(design("single"), ("good", "bad"))
    shown = (Shown("good", "run", "plain", str(places.folder), digest),
             Shown("bad", "run", CHANGED, str(places.folder), digest), *sheet.conditions[2:])
    sheet = replace(sheet, conditions=shown)
    result = analyse(sheet, Received({str(k): simulated(sheet, k, QUALITY) for k in range(3)}, {}))
    assert leave_scores(result, "key") == [] and not places.viewing.exists()  # of a test that was not made of it
    sheet.save(tmp_path)
    key = files.digest(tmp_path / KEY)
    assert note_test(sheet, tmp_path) == [] == note_test(sheet, tmp_path)
    assert leave_scores(result, "another key") == [] == list(read_scores(places.folder))
    assert leave_scores(result, key) == [places.viewing] == leave_scores(result, key)
    assert [(s.style, s.score) for s in read_scores(places.folder)] == [("plain", result.scores["good"].value)]
    files.write_text(places.model, "trained anew")
    assert leave_scores(result, key) == [] and read_scores(places.folder) == ()


def test_a_design_of_the_user_is_named_where_it_is_wrong_and_nothing_is_looked_up_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, path = (CONF / "preference.yaml").read_text(), tmp_path / "own.yaml"
    path.write_text(text.replace("title: ", "title: ${oc.env:HOME} "))
    assert read_design(str(path)).title.startswith("${oc.env:HOME}")
    for wrong in ("", "sentences: -1\n", "- a\n", "kind: [preference\n"):
        path.write_text(wrong)
        assert run_command("viewing", "power", path) == 1 and str(path) in capsys.readouterr().err


def test_what_the_docs_show_of_a_design_is_read(tmp_path: Path) -> None:
    text = (CONF.parents[1] / "docs" / "viewing.md").read_text()
    shown = [block.split("```")[0] for block in text.split("```yaml\n")[1:]]
    (tmp_path / "own.yaml").write_text((CONF / "preference.yaml").read_text() + "".join(shown))
    made = read_design(str(tmp_path / "own.yaml"))
    assert made.questions[0].choices == ("yes", "no") and len(made.questions) == 2
    assert [c.name for c in made.conditions][::4] == ["plain", "random"] and made.conditions[1].dials


def test_answers_that_lie_elsewhere_need_the_test_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = sheet_of(design("single"))
    for number in range(3):
        files.write_json(tmp_path / "sent" / f"{number}.json", plain(simulated(sheet, number, QUALITY)))
    sheet.save(tmp_path / "test")
    assert run_command("viewing", "analyse", tmp_path / "sent") == 1
    assert "--test FOLDER" in capsys.readouterr().err
    assert run_command("viewing", "analyse", tmp_path / "none") == 1
    assert "none: no such folder" in capsys.readouterr().err
    words = ["viewing", "analyse", tmp_path / "sent", "--test", tmp_path / "test", "--out", tmp_path / "out"]
    assert run_command(*words) == 0 and (tmp_path / "out" / "viewing.html").is_file()


def test_the_commands_of_power_and_of_designs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("viewing", "power", "preference", "--viewers", "10,40", "--effect", "0.6,0.8") == 0
    said = capsys.readouterr().out
    assert "no result" in said and "for 80%" in said
    assert run_command("viewing", "power", "nothing") == 2
    assert "one of dscqs, intelligibility" in capsys.readouterr().err
    assert run_command("viewing", "power", "preference", "--effect", "6") == 2
