"""The viewer's page in headless Chromium: what a person does there is measured in the server."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.physics.arrays import Array
from asset2sim.viewer.serve import open_viewer
from asset2sim.viewer.session import REFINED
from schemas.errors import UsageError
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Engine, FailureMode
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, RAW, prior, sample
from tests.chromium import chromium, needs_chromium
from tests.factories import make_failure
from tests.processes import free_port
from tests.test_catalog_query import told

pytest.importorskip("viser", reason="viser is not installed: the extra 'view' has it")
pytestmark = [pytest.mark.system, needs_chromium]
WIDTH, HEIGHT = 640, 420
LIMIT_S = 120.0
"""Longest wait for anything: pictures are drawn without a graphics card, beside other tests."""
DESK, GONE = "table_two_drawers", "without_mesh"
QUICK = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False)})


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A chest of drawers, refined by the real pipeline, and an asset of which nothing was written."""
    folder = tmp_path_factory.mktemp("out")
    started = start_run(Settings(), str(RAW))
    record = refine_asset(sample(DESK), folder, QUICK, ask=prior)
    write_run(folder, finish_run(started), [record, make_failure(GONE, FailureMode.MISSING_MESH)])
    return folder


@pytest.fixture(scope="module")
def viewer(out: Path) -> Iterator[Any]:
    port = free_port()
    with open_viewer(
        out, DESK, engine=Engine.PYBULLET, host="127.0.0.1", port=port, settings=EngineSettings()
    ) as found:
        # A processor draws this page: the shadows cost it more than all the rest.
        found.server.scene.configure_default_lights(cast_shadow=False)
        yield found


@pytest.fixture(scope="module")
def asked() -> list[str]:
    """What the page asked for."""
    return []


@pytest.fixture(scope="module")
def page(viewer: Any, asked: list[str]) -> Iterator[Any]:
    with chromium(WIDTH, HEIGHT) as browser:
        found = browser.pages[0]
        found.set_default_timeout(1000.0 * LIMIT_S)
        found.on("request", lambda request: asked.append(request.url))
        found.on("websocket", lambda socket: asked.append(socket.url))
        found.goto(viewer.address)
        found.get_by_role("heading", name=DESK).wait_for()
        # Its software renderer is announced over the picture.
        found.get_by_text("Software WebGL rendering detected").wait_for()
        found.locator(".mantine-Notification-closeButton").first.click()
        yield found


def soon(page: Any, holds: Callable[[], bool]) -> bool:
    """Whether it comes true in time; the page goes on meanwhile."""
    until = time.monotonic() + LIMIT_S
    while time.monotonic() < until:
        if holds():
            return True
        page.wait_for_timeout(100)
    return False


def opening(viewer: Any, joint: str) -> float:
    """How far a drawer is open in the simulation, m."""
    position = viewer.commands.ask(lambda: viewer.session.sides[REFINED].positions()[joint])
    return float(position)


def pixel(viewer: Any, point: Array) -> tuple[float, float]:
    """Where the page draws a (3,) point of the refined object's world."""
    (client,) = viewer.server.get_clients().values()
    camera = client.camera
    w, x, y, z = camera.wxyz
    seen = Rotation.from_quat([x, y, z, w]).inv().apply(point + viewer.stage.nodes[REFINED].place - camera.position)
    focal = camera.image_height / 2.0 / np.tan(camera.fov / 2.0)
    return (
        float(camera.image_width / 2.0 + focal * seen[0] / seen[2]),
        float(camera.image_height / 2.0 + focal * seen[1] / seen[2]),
    )


def test_the_page_connects_and_asks_nobody_else_for_anything(viewer: Any, page: Any, asked: list[str]) -> None:
    assert soon(page, lambda: page.locator("canvas").count() > 0 and len(viewer.server.get_clients()) == 1)
    assert soon(page, lambda: "kinetic energy" in page.content())
    here = viewer.address.removeprefix("http:")
    beyond = [url for url in asked if not url.startswith(("data:", f"http:{here}", f"ws:{here}", f"blob:http:{here}"))]
    assert not beyond and any(url.startswith(f"ws:{here}") for url in asked)
    assert viewer.server.request_share_url() is None
    assert viewer.server.get_host() == "127.0.0.1"


def test_a_slider_moves_the_joint(viewer: Any, page: Any) -> None:
    assert opening(viewer, "joint_0") < 0.01
    slider = page.get_by_role("slider").first
    slider.focus()
    slider.press("End")
    assert soon(page, lambda: opening(viewer, "joint_0") > 0.3)
    page.get_by_role("button", name="Reset").click()
    assert soon(page, lambda: opening(viewer, "joint_0") < 0.01)


def test_a_typed_value_beyond_the_limit_is_refused_with_a_word(viewer: Any, page: Any) -> None:
    field = page.locator(".mantine-NumberInput-input").first

    def typed(value: str) -> None:
        """On a busy machine the page may put the joint's own position over what is typed: it is typed anew then."""
        if field.input_value() != value:
            field.fill(value)
        page.wait_for_timeout(500)

    def is_refused() -> bool:
        typed("4000")
        return bool(page.get_by_text("4000 is refused").is_visible())

    def is_opened() -> bool:
        typed("10")
        return opening(viewer, "joint_0") > 0.09

    assert soon(page, is_refused)
    assert opening(viewer, "joint_0") < 0.01
    assert soon(page, lambda: float(field.input_value()) < 1.0)
    assert soon(page, is_opened)
    assert soon(page, lambda: not page.get_by_text("is refused").is_visible())
    page.get_by_role("button", name="Reset").click()
    assert soon(page, lambda: opening(viewer, "joint_0") < 0.01)


def test_a_drag_with_the_mouse_opens_the_drawer(viewer: Any, page: Any) -> None:
    def front() -> tuple[Array, Array]:
        """The middle of the upper drawer's front, and the way in which it opens."""
        side = viewer.session.sides[REFINED]
        pose = side.poses()["link_0"]
        corners = viewer.stage.nodes[REFINED].shapes.corners["link_0"] @ pose[:3, :3].T + pose[:3, 3]
        way = pose[:3, :3] @ side.joints["joint_0"].tree.axis
        ahead = corners[corners @ way > (corners @ way).mean()]
        return ahead.mean(axis=0), way

    before = opening(viewer, "joint_0")
    place, way = viewer.commands.ask(front)
    (x, y), (to_x, to_y) = pixel(viewer, place), pixel(viewer, place + 0.25 * way)
    page.mouse.move(x, y)
    page.mouse.down()
    for share in np.linspace(0.1, 1.0, 6):
        page.mouse.move(x + share * (to_x - x), y + share * (to_y - y))
    assert soon(page, lambda: opening(viewer, "joint_0") > before + 0.05)
    assert viewer.commands.ask(lambda: viewer.session.sides[REFINED].readings().hand_n) > 0.0
    page.mouse.up()
    assert soon(page, lambda: bool(viewer.commands.ask(lambda: viewer.session.sides[REFINED].grip is None)))
    assert opening(viewer, "joint_1") < 0.2, "only what is held is drawn"


def test_a_failure_is_reviewed_and_failures_knows(
    viewer: Any, page: Any, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "1 of 1 failures not reviewed" in told(["failures", "--reviewed"], out, capsys)
    page.get_by_role("button", name="Next").click()
    page.get_by_role("heading", name=GONE).wait_for()
    assert soon(page, lambda: "nothing was written of it" in page.content())
    page.get_by_role("tab", name="Review").click()
    page.locator("textarea:not([aria-hidden])").fill("the mesh is lost on the server")
    page.get_by_role("button", name="Bad").click()
    assert soon(page, lambda: len(read_table(out, "reviews")) == 1)
    (row,) = read_table(out, "reviews").to_dict("records")
    assert (row["asset_id"], row["verdict"], row["note"]) == (GONE, "bad", "the mesh is lost on the server")
    shown = told(["failures", "--reviewed"], out, capsys)
    assert "0 of 1 failures not reviewed" in shown and "bad" in shown and "the mesh is lost" in shown
    page.get_by_role("heading", name=DESK).wait_for()


def test_what_cannot_be_served_is_the_user_s_mistake(viewer: Any, out: Path) -> None:
    port = viewer.server.get_port()
    for asset_id, where, said in ((DESK, port, "cannot be used"), ("desk", free_port(), "unknown asset 'desk'")):
        with (
            pytest.raises(UsageError, match=said),
            open_viewer(out, asset_id, engine=Engine.PYBULLET, host="127.0.0.1", port=where, settings=EngineSettings()),
        ):
            pass
