"""The rating page in headless Chromium: three scripted raters, one of whom comes back; and nothing names a method."""

import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asset2sim.assets.folder import URDF_NAME
from asset2sim.catalog.own_files import read_own_files
from asset2sim.catalog.write import write_run
from asset2sim.viewer.session import REFINED
from lab.flows.rate import open_rating
from lab.judged.figures import joined, krippendorff_alpha, rater_matrix
from lab.judged.rating_desk import HAND_N_M
from lab.judged.rating_page import BEGIN, BROKEN, LEAVE, NAMELESS, NEXT, START, STORE, UNSEEN, UNSTORED
from lab.judged.rating_plan import Durations, variants_of
from lab.judged.variant_folders import variant_folders
from lab.schemas.tables import RATING_KEYS, RATINGS
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, Method
from tests.chromium import chromium, needs_chromium
from tests.exported import arm
from tests.factories import make_record
from tests.processes import free_port
from tests.test_catalog_history import night

pytest.importorskip("viser", reason="viser is not installed: the extra 'view' has it")
zstandard = pytest.importorskip("zstandard", reason="zstandard is not installed: viser brings it")
pytestmark = [pytest.mark.system, needs_chromium]
LIMIT_S = 120.0
HTML = """() => { const all = document.documentElement.cloneNode(true);
all.querySelectorAll("script, style").forEach(item => item.remove()); return all.outerHTML; }"""
"""The page without viser's own program and styles, which are the same whatever is shown."""
QUICK = Durations(untouched_s=0.1, least_touched_s=0.1, most_touched_s=0.2)
SCORES = {
    "ann": {"direct": 2, "asset2sim": 8},
    "bob": {"direct": 3, "asset2sim": 9},
    "cid": {"direct": 1, "asset2sim": 7},
}
"""Rater → method → the score in all, which the test gives after a look at the keys."""


@dataclass
class Rated:
    """What the raters left: the folder, all that the browser was sent, decoded, and what was seen on the way."""

    out: Path
    received: list[bytes] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    html: list[str] = field(default_factory=list)
    seen: dict[str, Any] = field(default_factory=dict)


def decoded(message: bytes | str) -> bytes:
    """A message with everything that zstd packed in it, and in that, unpacked behind it."""
    raw = message.encode() if isinstance(message, str) else message
    found = [raw]
    for match in re.finditer(re.escape(b"\x28\xb5\x2f\xfd"), raw):
        try:
            found.append(decoded(zstandard.ZstdDecompressor().decompressobj().decompress(raw[match.start() :])))
        except zstandard.ZstdError:  # four bytes of something else
            continue
    return b"\n".join(found)


@contextmanager
def desk_of(out: Path) -> Iterator[Any]:
    variants, _ = variants_of(variant_folders([out]), (), ())
    port = free_port()
    with open_rating(
        out, variants, engine=Engine.PYBULLET, host="127.0.0.1", port=port, settings=EngineSettings(),
        durations=QUICK, seed=3,
    ) as desk:  # fmt: skip
        # A processor draws this page: the shadows cost it more than all the rest.
        desk.server.scene.configure_default_lights(cast_shadow=False)
        yield desk


class Rater:
    """A person at the page."""

    def __init__(self, page: Any, found: Rated) -> None:
        self.page, self.found = page, found

    def soon(self, holds: Callable[[], bool]) -> None:
        """Wait until it comes true; the page goes on meanwhile."""
        until = time.monotonic() + LIMIT_S
        while not holds():
            assert time.monotonic() < until, "in vain"
            self.page.wait_for_timeout(50)

    def click(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def arrive(self, desk: Any, name: str) -> None:
        self.page.goto(desk.address)
        self.name(name)

    def name(self, name: str) -> None:
        self.page.get_by_text("Your name or code").wait_for()
        self.page.locator("input:visible").first.fill(name)
        self.click(BEGIN)

    def stage(self, number: int) -> None:
        self.page.get_by_text(f"Stage {number} of 3").wait_for()
        self.found.html.append(self.page.evaluate(HTML))

    def rate(self, desk: Any, rater: str, note: str = "") -> None:
        """All stages of what is shown, with the score that the rater has for its method."""
        self.stage(1)
        shown = desk.left[0]
        score = SCORES[rater][shown.variant.stop.method]
        assert desk.stage.nodes, "nothing is scored before it is drawn"
        assert desk.session.sides[REFINED].seconds == 0.0 and not desk.running
        self.click(str(score))
        self.click(NEXT)
        self.stage(2)
        self.click(str(score))
        assert self.page.get_by_role("button", name=NEXT, exact=True).is_disabled(), "it was not watched yet"
        self.click(START)
        self.soon(lambda: not desk.running and desk.seconds > 0.9 * QUICK.untouched_s)
        self.click(NEXT)
        self.stage(3)
        self.click(START)
        self.click(str(score))
        self.click(NEXT)
        self.page.get_by_text("In all.").wait_for()
        self.page.locator("textarea:not([aria-hidden])").fill(note)
        self.click(str(score))
        self.click(STORE)
        self.soon(lambda: not desk.left or desk.left[0] is not shown)


@pytest.fixture(scope="module")
def rated(tmp_path_factory: pytest.TempPathFactory) -> Rated:
    """An arm on a hinge in two variants, in a comparison's folders, rated by three; the second leaves after one, and
    comes back after the third."""
    found = Rated(tmp_path_factory.mktemp("compared"))
    for method in (Method.DIRECT, Method.ASSET2SIM):
        out = found.out / method.value / "prior_household"
        folder = out / "assets" / "thing"
        folder.mkdir(parents=True)
        arm(folder, initial=0.2)
        write_run(out, night(1), [make_record("thing", method=method)])
    with chromium(600, 240) as browser:
        page = browser.pages[0]
        page.set_default_timeout(1000.0 * LIMIT_S)
        page.on("request", lambda request: found.asked.append(request.url))
        page.on("websocket", lambda socket: socket.on("framereceived", lambda message: found.received.append(message)))
        rater = Rater(page, found)
        with desk_of(found.out) as desk:
            rater.arrive(desk, "Ann")
            # Its software renderer is announced over the picture.
            page.get_by_text("Software WebGL rendering detected").wait_for()
            page.locator(".mantine-Notification-closeButton").first.click()
            rater.rate(desk, "ann")
            rater.rate(desk, "ann", "the second")
            page.get_by_text("You have rated all 2 variants").wait_for()
            rater.click(LEAVE)
            rater.name("bob")
            rater.rate(desk, "bob")
            rater.stage(1)
            rater.click(LEAVE)
            rater.name("cid")
            rater.rate(desk, "cid")
            rater.rate(desk, "cid")
            page.get_by_text("Thank you").wait_for()
            rater.click(LEAVE)
            rater.name(" BOB ")
            rater.stage(1)
            found.seen["back"] = [(item.label, item.presented) for item in desk.left]
            rater.rate(desk, "bob")
            page.get_by_text("You have rated all 2 variants").wait_for()
    return found


def test_every_score_is_stored_with_its_stages_order_and_note(rated: Rated) -> None:
    ratings, keys = read_own_files(rated.out, RATINGS), read_own_files(rated.out, RATING_KEYS)
    assert len(ratings) == len(keys) == 6
    rows = joined(ratings, keys)
    for row in rows.to_dict("records"):
        stages = [row[name] for name in ("score_before", "score_untouched", "score_touched", "score")]
        assert stages == [SCORES[row["rater"]][row["method"]]] * 4
        assert row["seconds"] > row["seconds_touched"] > 0.09 and row["run_id"] == night(1).run_id
        assert row["label"] == "AB"[row["position"]] and row["presented"] == row["position"] and row["seed"] == 3
    assert rows.groupby("rater")["position"].apply(sorted).tolist() == [[0, 1]] * 3
    assert rows[rows["rater"] == "ann"]["note"].tolist() == ["", "the second"]


def test_a_rater_goes_on_where_they_left(rated: Rated, tmp_path: Path) -> None:
    assert rated.seen["back"] == [("B", 1)]
    with desk_of(shutil.copytree(rated.out, tmp_path / "out")) as desk:
        for rater, left in (("ann", 0), ("dora", 2)):
            desk.begin(rater)
            assert desk.commands.ask(lambda: len(desk.left)) == left, "served anew, from where the folder was moved to"


def test_alpha_of_the_three_is_the_one_worked_by_hand(rated: Rated) -> None:
    """Units (2, 3, 1) and (8, 9, 7): in each, squares of ordered pairs add up to 12, over 3 − 1 raters 6; observed
    (6 + 6) / 6. All thirty ordered pairs: 2 (6 · 208 − 30²) = 696; expected 696 / 30."""
    rows = joined(read_own_files(rated.out, RATINGS), read_own_files(rated.out, RATING_KEYS))
    assert krippendorff_alpha(rater_matrix(rows)) == pytest.approx(1.0 - 2.0 / (696.0 / 30.0))


def test_nothing_that_the_browser_gets_names_a_method_a_folder_or_a_file(rated: Rated) -> None:
    received = b"\n".join(map(decoded, rated.received))
    # What the page is about comes through, so a name would be found.
    for told in (b"a small closed box", b"variant B", b"Stage 3 of 3", b"glTF"):
        assert told in received
    assert len(rated.html) >= 18 and all("a small closed box" in html for html in rated.html)
    methods = "|".join(re.escape(method.value) for method in Method)
    folders = "|".join(map(re.escape, (str(rated.out), rated.out.name, "prior_household", night(1).run_id, "urdf")))
    secret = re.compile(rf"\b({methods}|human)\b|{folders}|prior/|overlay\.json", re.IGNORECASE)
    assert secret.search("the method asset2sim") and secret.search(f"x{rated.out}/y")
    for text in (received.decode("latin-1"), *rated.html, *rated.asked):
        hit = secret.search(text)
        assert hit is None, text[max(0, hit.start() - 80) : hit.end() + 80]


@pytest.fixture
def copied(rated: Rated, tmp_path: Path) -> Path:
    """The comparison before anybody rated it, for tests without a browser."""
    return Path(shutil.copytree(rated.out, tmp_path / "out", ignore=shutil.ignore_patterns("ratings", "rating_keys")))


def test_a_part_can_be_dragged_in_the_third_stage_alone_and_always_by_the_same_spring(copied: Path) -> None:
    with desk_of(copied) as desk:
        desk.begin("dan")
        side = desk.commands.ask(lambda: desk.session.sides[REFINED])
        place = desk.commands.ask(lambda: side.poses()["arm"][:3, 3] + np.array([0.1, 0.0, 0.0]))
        held = []
        for score in (1.0, 2.0, 3.0):
            desk.start()
            desk.grabbed(REFINED, "start", "arm", place, place)
            held.append(desk.commands.ask(lambda: side.grip and side.grip.stiffness_n_m))
            desk.commands.ask(lambda score=score: desk.go_on(score))
        assert held == [None, None, HAND_N_M]
        desk.commands.ask(lambda: None)
        assert desk.given == [1.0, 2.0, 3.0] and desk.commands.ask(lambda: side.grip) is None
        lent = desk.commands.ask(lambda: [side.hand(link, place, HAND_N_M) for link in ("arm", "base")])
        assert [stiffness for stiffness, _ in lent] == [HAND_N_M] * 2, "whatever it weighs"
        assert lent != desk.commands.ask(lambda: [side.hand(link, place) for link in ("arm", "base")])


def test_what_goes_wrong_is_said_without_a_name_and_loses_no_rater(copied: Path) -> None:
    """A variant whose folder is gone, one that no engine loads, and a place where nothing can be stored."""
    with desk_of(copied) as desk:
        shutil.rmtree(copied / "direct" / "prior_household" / "assets")
        broken = copied / "asset2sim" / "prior_household" / "assets" / "thing" / URDF_NAME
        broken.write_text(
            broken.read_text(encoding="utf-8").replace("<robot", "<object").replace("</robot", "</object"),
            encoding="utf-8",
        )
        said, desk.page.tell = [], lambda line: said.append(line)
        desk.begin("")
        desk.begin("eve")
        for number in range(2):
            desk.commands.ask(lambda: None)
            for score in (1.0, 2.0, 3.0):
                desk.start()
                desk.commands.ask(lambda score=score: desk.go_on(score))
            if number:
                shutil.rmtree(copied / "ratings")
                (copied / "ratings").write_text("in the way", encoding="utf-8")
            desk.commands.ask(lambda: desk.store(4.0, ""))
            desk.commands.ask(lambda: None)
        assert len(desk.left) == 1, "the second is not stored"
        (copied / "ratings").unlink()
        desk.commands.ask(lambda: desk.store(4.0, ""))
        assert desk.commands.ask(lambda: len(desk.left)) == 0 and len(read_own_files(copied, RATINGS)) == 2
        assert {line for line in said if line} <= {NAMELESS, UNSEEN, BROKEN, UNSTORED}
        assert {NAMELESS, UNSEEN, UNSTORED} <= set(said)
