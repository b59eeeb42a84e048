"""`python -m avn.report` on runs of the mini split, looked at in Chromium."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from browser import PHONE, chromium, opened, overflows, until
from made_runs import records
from small import EYES, SMALL, fitting

from avn import report
from avn.reporting import page_media
from avn.reporting.comparison import compare
from avn.reporting.page import PageRun, render
from avn.reporting.results import EPISODE_COLUMNS, summarise


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


def made(command, outputs, agent, *more):
    eyes = EYES if agent == "plan_noexp" else ()
    settings = fitting(f"agent={agent}", *SMALL, *eyes)
    code, out, err = command("eval", f"agent={agent}", *settings, f"outputs={outputs}", *more)
    assert code == 0, err
    return Path(out[-1])


@pytest.fixture
def page(command, outputs, capfd):
    """The page of three runs, made once."""
    path = outputs / "report" / "three.html"
    if not path.is_file():
        folders = [str(made(command, outputs, agent)) for agent in AGENTS]
        assert report.main([*folders, "--output", str(path)]) == 0
    return path


AGENTS = ("plan_noexp", "plan_exp", "greedy")


def column(opened_page, index):
    return opened_page.eval_on_selector_all(
        f"#results tbody tr > :nth-child({index})", "cells => cells.map(c => c.dataset.sort)"
    )


def test_the_table_sorts_by_either_figure(browser, page):
    with opened(browser, page) as shown:
        assert shown.locator("#results tbody tr").count() == len(AGENTS) * 3
        last = shown.locator("#results thead th").count()
        for figure in ("spl", "sr"):
            shown.locator(f"input[name=by][value={figure}]").check()
            shown.locator("#results thead th").last.click()
            shown.wait_for_timeout(100)
            values = [float(value) for value in column(shown, last)]
            assert values in (sorted(values), sorted(values, reverse=True))
            assert len(set(values)) > 1
        # with the keyboard too, and the other way round
        shown.locator("#results thead th").last.press("Enter")
        shown.wait_for_timeout(100)
        assert [float(value) for value in column(shown, last)] == values[::-1]


def test_figures_are_those_of_the_run_and_of_mini_they_mean_nothing(
    browser, page, command, outputs
):
    run = made(command, outputs, "greedy")
    table = pd.read_csv(run / "results.csv").query("sound == 'alarm' and scene == 'room_1'")
    row = (100 * table[["sr", "spl"]]).iloc[0]
    with opened(browser, page) as shown:
        cell = shown.locator("td.cell[data-run='2'][data-sound=alarm][data-scene=room_1]")
        assert cell.inner_text().strip() == f"{row['sr']:.1f} / {row['spl']:.1f}"  # two sources
        words = shown.locator("header").inner_text()
        assert "too few sources (fewer than 5), for an interval" in words
        assert "its figures mean nothing" in words
        assert "test apartments of mini" in words
        assert "paper" not in shown.locator("main").inner_text()


def drawn_run(paper, values=(0.15146, 1.0), sources=5):
    """A run of the page: episodes of five sources in two apartments with one sound."""
    rows = [
        dict.fromkeys(EPISODE_COLUMNS, 0)
        | {"agent": "greedy", "protocol": "var", "acoustics": "resonance", "look": "once"}
        | {"sound": "ring", "scene": scene, "source": source, "episode": source}
        | {"geodesic": 2.0, "outcome": "success", "success": 1, "spl": values[0]}
        for scene in ("room_1", "room_2")
        for source in range(sources)
    ]
    episodes = pd.DataFrame(rows)
    return PageRun(
        "greedy", "", "", False, summarise(episodes), episodes, {}, paper=paper, world="protocol x"
    )


def test_figures_are_rounded_once_and_the_papers_stand_where_they_belong(browser, tmp_path):
    for name, paper in (("with", ("ring",)), ("without", ())):
        path = tmp_path / f"{name}.html"
        path.write_text(render("Runs", [drawn_run(paper)], [], [], []), encoding="utf-8")
        with opened(browser, path) as shown:
            cell = shown.locator("td.cell[data-scene=room_1]")
            assert cell.locator("b").inner_text() == "100.0 / 15.1"  # not 15.15, then 15.2
            assert "15–15" in cell.inner_text()
            assert "paper" not in cell.inner_text()  # whose rooms are not ours
            average = shown.locator("td.cell[data-scene=average]")
            assert ("paper 12.4 / 11.1" in average.inner_text()) == bool(paper)
            assert "Protocol x." in shown.locator("header").inner_text()


def test_two_runs_have_an_interval_a_test_and_the_smallest_difference(browser, tmp_path):
    walked = [records(agent, rate=rate) for agent, rate in (("one", 0.3), ("two", 0.7))]
    walked.append(records("three").assign(protocol="stop"))
    names = ("one", "two", "three")
    runs = [
        PageRun(name, "", "", False, summarise(own), own, {})
        for name, own in zip(names, walked, strict=True)
    ]
    path = tmp_path / "page.html"
    path.write_text(render("Runs", runs, [], [], []), encoding="utf-8")
    with opened(browser, path) as shown:
        assert "95 %, apartments, sources and episodes" in shown.locator("header").inner_text()
        row = compare(walked[1], walked[0]).table.set_index("metric").loc["sr"] * 100
        second, third = shown.locator("#differences tbody tr").all_inner_texts()
        for text in (f"{row['low']:+.1f} to {row['high']:+.1f}", "McNemar's exact test", "p "):
            assert text in second
        assert f"smallest shown {row['detectable']:.1f}" in second
        assert "not compared: three and one have different protocols (stop and var)" in third
        shown.locator("#run-a").select_option("1")
        shown.locator("#run-b").select_option("0")
        tested = shown.locator("#tested").inner_text()
        assert tested.startswith(f"A less B: success {row['difference']:+.1f} points")
        shown.locator("#run-b").select_option("2")
        assert "Not compared" in shown.locator("#tested").inner_text()
        shown.locator("#run-b").select_option("1")
        assert shown.locator("#tested").inner_text() == ""


def test_a_cell_opens_its_episodes_and_an_episode_plays(browser, page, command, outputs):
    episodes = pd.read_csv(made(command, outputs, "plan_noexp") / "episodes.csv")
    with opened(browser, page) as shown:
        shown.locator("td.cell[data-run='0'][data-sound=clock][data-scene=room_1]").click()
        rows = shown.locator("#episode-list tbody tr")
        assert rows.count() == len(episodes.query("sound == 'clock'"))
        shown.locator("#episode-list tr.open").first.click()
        number = shown.locator("#episode-list tr.open td").nth(3).inner_text()
        row = episodes.query(f"sound == 'clock' and episode == {number}").iloc[0]
        sound = "document.getElementById('sound')"
        until(shown, f"{sound}.readyState === 4")
        assert shown.evaluate(f"{sound}.duration") == pytest.approx(row["actions"] + 1, abs=0.2)
        assert shown.evaluate("document.getElementById('view').naturalWidth") == 32
        # a step on: view, sound and the agent on the plan go with it
        places = []
        for step in range(3):
            places.append(shown.locator("#agent").get_attribute("transform"))
            assert f"step {step} of {row['actions']}" in shown.locator("#caption").inner_text()
            shown.locator("#on").click()
        assert len(set(places)) > 1
        assert shown.evaluate(f"{sound}.currentTime") == pytest.approx(3, abs=0.1)
        # the belief lies on the plan and can be taken off
        assert shown.locator("#belief").is_visible()
        shown.locator("#show-belief").uncheck()
        assert not shown.locator("#belief").is_visible()
        # while it plays, the steps follow
        shown.evaluate(f"{sound}.muted = true")
        shown.evaluate(f"{sound}.play()")
        until(shown, f"{sound}.currentTime > 3.4")
        assert int(shown.locator("#step").input_value()) >= 3


def test_the_same_episode_of_other_runs_stands_beside(browser, page):
    with opened(browser, page) as shown:
        shown.locator("td.cell[data-run='0'][data-sound=alarm][data-scene=room_1]").click()
        shown.locator("#episode-list tr.open").first.click()
        titles = set()
        assert shown.locator("#twins button").count() == len(AGENTS)
        for index, agent in enumerate(AGENTS):
            button = shown.locator("#twins button").nth(index)
            button.click()
            assert button.inner_text().startswith(f"{agent}: ")
            assert button.get_attribute("aria-pressed") == "true"
            titles.add(shown.locator("#episode-title").inner_text())
            assert shown.locator("circle.entry").count() == (3 if agent == "plan_exp" else 0)
            assert shown.locator("#belief").is_visible() == (agent != "greedy")
        assert len(titles) == 1
        assert shown.locator("#differences tbody tr").count() == 2


def test_it_is_readable_on_a_phone(browser, page):
    with opened(browser, page, PHONE) as shown:
        assert not overflows(shown)
        shown.locator("td.cell").first.click()
        shown.locator("#episode-list tr.open").first.click()
        until(shown, "document.getElementById('sound').readyState === 4")
        assert not overflows(shown)
        box = shown.locator("#view").bounding_box()
        assert box["width"] > 300


def test_what_comes_from_names_is_shown_and_never_run(browser, tmp_path):
    evil = (
        "</script><script>window.bad=1</script><img src=x onerror=window.bad=1>\u2028'\"&amp;{{1}}"
    )
    row = {"agent": evil, "protocol": evil, "acoustics": evil, "look": evil, "sound": evil}
    row |= {
        "scene": evil,
        "seed": 0,
        "episode": 0,
        "source": 0,
        "source_cell": 0,
        "outcome": evil,
        "geodesic": 2.0,
    }
    row |= {"in_sight": 1, "rooms_crossed": 0, "actions": 3, "start_cell": 0, "start_heading": 0}
    row |= {"success": 1, "spl": 1.0, "softspl": 1.0, "sna": 1.0, "dtg": 0.0, "sna_goal": 1.0}
    episodes = pd.DataFrame([row])
    run = PageRun(evil, evil, evil, True, summarise(episodes), episodes, {0: 0})
    pixel = page_media.view_url(np.zeros((4, 4, 3), dtype=np.uint8))
    plan = {"image": pixel, "left": 0.0, "top": 4.0, "width": 4.0, "height": 4.0}
    episode = {"title": evil, "outcome": evil, "goals": [[1, 1]], "path": [[1, 1, 0], [1, 2, 0]]}
    episode |= {
        "action": [0],
        "collided": [0, 0],
        "source_estimates": None,
        "belief": None,
        "memory": None,
    }
    episode |= {"sound": page_media.sound_url(np.zeros((32000, 2), dtype=np.float32), 16000)}
    episode |= {"run": 0, "plan": 0, "views": [0, 0], "twins": [0]}
    html = render(evil, [run], [plan], [pixel], [episode])
    path = tmp_path / "evil.html"
    path.write_text(html, encoding="utf-8")
    with opened(browser, path) as shown:
        shown.locator("td.cell").first.click()
        shown.locator("#episode-list tr.open").first.click()
        shown.wait_for_timeout(200)
        assert shown.evaluate("window.bad") is None
        assert shown.locator("h1").text_content() == evil
        assert shown.locator("#episode-title").text_content() == evil
        assert evil in shown.locator("#twins").text_content()
        assert shown.locator("img[src=x]").count() == 0
        assert not overflows(shown)


def test_a_page_lies_in_outputs_and_may_hold_tables_alone(command, outputs, capfd):
    folder = made(command, outputs, "random_walk")
    assert report.main([str(folder), "--episodes", "0"]) == 0
    path = Path(capfd.readouterr().out.splitlines()[-1])
    assert path.parent == outputs.resolve() / "report"
    assert path.name.startswith("report-")
    html = path.read_text(encoding="utf-8")
    assert "data:audio" not in html
    assert "http" not in html.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")


def test_mistakes_are_one_line(command, outputs, capfd, tmp_path):
    folder = str(made(command, outputs, "random_walk"))
    for arguments, said in (
        ([str(tmp_path)], "no run's folder"),
        ([folder, folder], "a folder is given twice"),
        ([folder, "--episodes", "-1"], "--episodes: -1 is less than 0"),
        ([folder, "--show", "best"], "'best' is none of"),
        ([folder, "--episodes", "0", "--output", "/proc/no/page.html"], "/proc/no"),
    ):
        assert report.main(arguments) == 2
        (line,) = capfd.readouterr().err.strip().splitlines()
        assert said in line


def test_runs_of_several_seeds_stand_together_too(browser, command, outputs, capfd, tmp_path):
    runs = [made(command, outputs, "greedy", f"seed={seed}") for seed in (0, 1)]
    runs += [made(command, outputs, "random_walk", f"seed={seed}") for seed in (0, 1)]
    path = tmp_path / "seeds.html"
    assert report.main([*map(str, runs), "--output", str(path)]) == 0
    episodes = pd.concat([pd.read_csv(run / "episodes.csv") for run in runs[:2]])
    with opened(browser, path) as shown:
        names = shown.locator("#results tbody th").all_inner_texts()
        assert set(names) == {
            *("greedy, seeds 0, 1", "greedy, seed=0", "greedy, seed=1"),
            *("random_walk, seeds 0, 1", "random_walk, seed=0", "random_walk, seed=1"),
        }
        cell = shown.locator("td.cell[data-run='0'][data-sound=all][data-scene=room_1]")
        assert cell.locator("b").inner_text().startswith(f"{100 * episodes['success'].mean():.1f}")
        assert "over seeds" in cell.inner_text()
        cell.click()
        assert shown.locator("#episode-list tbody tr").count() == len(episodes)
        assert shown.locator("#episode-list tr.open").count() == 4  # two sounds, two seeds
        assert shown.locator("#differences tbody th").all_inner_texts() == [
            "random_walk, seeds 0, 1"
        ]


def test_the_ways_of_all_episodes_on_request(browser, command, outputs, capfd, tmp_path):
    folder = made(command, outputs, "greedy")
    path = tmp_path / "ways.html"
    options = ["--paths", "--show", "success,failure", "--output", str(path)]
    assert report.main([str(folder), *options]) == 0
    episodes = pd.read_csv(folder / "episodes.csv")
    with opened(browser, path) as shown:
        shown.locator("td.cell[data-sound=all][data-scene=room_1]").click()
        rows = shown.locator("#episode-list tr.open")
        assert rows.count() == len(episodes)
        rows.first.click()
        assert shown.locator("#sound").is_visible()
        rows.last.click()
        assert not shown.locator("#sound").is_visible()
        number, sound = (rows.last.locator("td").nth(i).inner_text() for i in (3, 2))
        row = episodes.query(f"episode == {number} and sound == '{sound}'").iloc[0]
        assert shown.locator("#step").get_attribute("max") == str(row["actions"])
        shown.locator("#step").fill(str(row["actions"]))
        assert row["outcome"].replace("_", " ") in shown.locator("#caption").inner_text()
        # it may be opened after one with sound, and that one again
        rows.first.click()
        until(shown, "document.getElementById('sound').readyState === 4")


def test_two_runs_are_compared_episode_by_episode_with_the_keyboard(
    browser, page, command, outputs
):
    one, other = (
        pd.read_csv(made(command, outputs, agent) / "episodes.csv")
        for agent in ("greedy", AGENTS[0])
    )
    both = one.merge(other, on=["scene", "sound", "episode"])
    with opened(browser, page) as shown:
        shown.locator("#run-a").select_option("2")
        shown.locator("#run-b").select_option("0")
        words = shown.locator("#compared").inner_text()
        only = (both["success_x"] > both["success_y"]).sum()
        assert f"{len(both)} common episodes. Only A succeeds: {only}." in words
        tested = shown.locator("#tested").inner_text()
        less = 100 * (both["success_x"].mean() - both["success_y"].mean())
        assert tested.startswith(f"A less B: success {less:+.1f} points; SPL ")
        assert "too few apartments" in tested  # mini has one, of two sources
        assert "McNemar, episodes as independent, p" in tested
        rows = shown.locator("#pairs tbody tr")
        assert rows.count() == len(both)
        shown.locator("#who").select_option("00")
        neither = both[["success_x", "success_y"]].max(axis=1) == 0
        assert rows.count() == neither.sum()
        shown.locator("#who").select_option("")
        # the player is reached and operated with keys alone
        shown.locator("#pairs button.opener").first.focus()
        shown.keyboard.press("Enter")
        assert shown.locator("#twins button").count() == 2
        assert shown.evaluate("document.activeElement.id") == "player"
        shown.keyboard.press("ArrowRight")
        assert shown.locator("#caption").inner_text().startswith("step 1 of")
        shown.keyboard.press("Home")
        assert shown.locator("#caption").inner_text().startswith("step 0 of")
        assert "facing" in shown.locator("#view").get_attribute("alt")
        assert "room_1" in shown.locator("#plan-image").get_attribute("alt")
    with opened(browser, page, PHONE) as shown:
        shown.locator("#pairs button.opener").first.click()
        assert not overflows(shown)
