# SPDX-License-Identifier: Apache-2.0
"""rw.view: as traits tell Python, and as a browser shows it. Jupyter's transport between both is
left out: in the browser, a stand-in of the model passes traits to the widget and back.
"""

import base64
import io
import json
import os
import select
import shutil
import subprocess
import sys

import numpy as np
import pytest

import raywave as rw

FOCUS = 20e-3
TRIANGLE = (np.array([[-2e-4, -2e-4, 0], [2e-4, 2e-4, 0], [2e-4, -2e-4, 0]]),
            np.array([[0, 1, 2]]))


def test_without_anywidget_it_says_what_to_install(scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "raywave._widget", raising=False)
    with pytest.raises(ImportError, match=r'pip install "raywave\[widget\]"'):
        rw.view(scene)


@pytest.fixture
def view():
    """A lit triangle, most of it at +x, without a width."""
    pytest.importorskip("anywidget")
    return rw.view(rw.Scene({
        "hologram": {"resolution": [256, 192], "pitch": "4 um"},
        "sampling": {"pitch": "10 um", "frames": 4},
        "viewer": {"resolution": "12 um"},
        "light": [{"direction": [0, 0, 1]}],
        "object": [{"mesh": TRIANGLE, "position": [0, 0, FOCUS]}],
    }))  # fmt: skip


def seen(png):
    """The light of a picture."""
    image = pytest.importorskip("PIL.Image")
    return (np.asarray(image.open(io.BytesIO(png)).convert("L")) / 255) ** 2.2


def middle(view):
    """Of the light, in metres, right and up as an eye sees it."""
    light, side = seen(view.picture), view._live.window[0]
    y, x = (side * ((np.arange(n) + 0.5) / n - 0.5) for n in light.shape)
    return (light.sum(0) * x).sum() / light.sum(), -(light.sum(1) * y).sum() / light.sum()


def within(view):
    """Share of the light within the object's square."""
    light = seen(view.picture)
    rest = round(len(light) * (0.5 - 0.2e-3 / view._live.window[0]))
    return light[rest:-rest, rest:-rest].sum() / light.sum()


def test_it_is_the_picture_of_a_live_view(scene):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("anywidget")
    view = rw.view(scene)
    view.view, view.aperture, view.rotation = (-0.4, 0.2), 0.5, (0.0, 30.0, 0.0)
    live = rw.LiveView(scene)
    live.look()
    poses = {0: (live.poses[0][0], (0, 30, 0))}
    picture = live.look(view=(-0.4, 0.2), aperture=0.5, poses=poses)
    assert np.array_equal(np.asarray(image.open(io.BytesIO(view.picture))), picture.image)


def test_an_eye_has_plus_x_at_the_left(view):
    assert view.focus == pytest.approx(FOCUS)
    right, up = middle(view)
    assert right == pytest.approx(-0.4e-3 / 6, rel=0.2)  # a third of the half side
    assert up == pytest.approx(-0.4e-3 / 6, rel=0.2)


def test_focus_on_the_object_is_sharper_and_traces_nothing(view, monkeypatch):
    monkeypatch.delattr(rw.Renderer, "render")
    sharp = within(view)
    for focus in (0.4 * FOCUS, 1.6 * FOCUS):
        view.focus = focus
        assert view.message.startswith("picture")
        assert within(view) < 0.7 * sharp
    view.focus = FOCUS
    assert within(view) == pytest.approx(sharp) and sharp > 0.9


def test_an_eye_to_the_right_sees_what_lies_beyond_the_focus_move_to_the_right(view):
    view.aperture, view.focus = 0.5, 0.75 * FOCUS
    places = []
    for x in (0.5, -0.5):  # half holograms; +x is an eye's left
        view.view = (x, 0)
        places.append(middle(view))
    moved = np.subtract(*places[::-1])
    assert moved[0] == pytest.approx(0.25 * 0.5 * 256 * 4e-6, rel=0.3)  # similar triangles
    assert abs(moved[1]) < 0.1 * moved[0]


def test_a_drag_turns_about_the_holograms_axes_after_what_was_before(view):
    before = view.picture
    view.drag = (0, 60)
    assert view.rotation == pytest.approx((0, 60, 0))
    assert view.message.startswith("hologram")
    widths = [np.ptp(np.flatnonzero(seen(p).sum(0) > 0.1 * seen(p).sum(0).max()))
              for p in (before, view.picture)]
    assert widths[1] == pytest.approx(0.5 * widths[0], rel=0.2)
    turned, focus = view.picture, view.focus
    for view.focus in (1.01 * focus, focus):
        assert (view.picture == turned) == (view.focus == focus)
    view.drag = (0, 90)
    view.drag = (90, 90)  # about x after y: as about x, then z
    assert view.rotation == pytest.approx((90, 0, 90))


@pytest.mark.parametrize("wrong, word", (
    ({"focus": 0.0}, "focus"), ({"focus": 98.0}, "metres"), ({"focus": float("nan")}, "metres"),
    ({"view": (2.0, 0.0)}, "view"), ({"aperture": -1.0}, "aperture"),
    ({"rotation": (float("nan"), 0.0, 0.0)}, "rotation"),
    ({"rotation": (0.0, 60.0, 0.0), "aperture": -1.0}, "aperture")))  # fmt: skip
def test_what_cannot_be_is_said_and_all_else_stays(view, wrong, word):
    def state():
        return view.focus, view.view, view.aperture, view.rotation, view.picture

    before = state()
    view.set_state(wrong)  # as a front end does
    assert word in view.message and " ms" not in view.message
    assert state() == before
    for view.focus in (1.01 * before[0], before[0]):  # the object, too, stays as it was
        assert view.message.startswith("picture")
    assert view.picture == before[-1]


class Page:
    """An empty page in a headless Chromium, by the DevTools protocol over two pipes."""

    def __init__(self, browser, folder):
        to_browser, self.to = os.pipe()
        from_page, from_browser = os.pipe()
        words = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
                 f"--user-data-dir={folder}", "--window-size=800,800"]
        self.browser = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "", *words],
            pass_fds=[to_browser, from_browser], stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.answers, self.text, self.calls, self.sent, self.session = from_page, b"", [], 0, {}
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        session = self.send("Target.attachToTarget", targetId=target, flatten=True)
        self.session = {"sessionId": session["sessionId"]}

    def send(self, method, **params):
        self.sent += 1
        message = {"id": self.sent, "method": method, "params": params, **self.session}
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.text:
                assert select.select([self.answers], [], [], 60)[0], "Chromium says nothing"
                self.text += os.read(self.answers, 2**20) or pytest.fail("Chromium has ended")
            text, _, self.text = self.text.partition(b"\0")
            answer = json.loads(text)
            if answer.get("method") == "Runtime.bindingCalled":
                self.calls.append(json.loads(answer["params"]["payload"]))
            if answer.get("id") == self.sent:
                return answer["result"]

    def run(self, script):
        """The value of a script, awaited."""
        done = self.send("Runtime.evaluate", expression=script, awaitPromise=True,
                         returnByValue=True)
        assert "exceptionDetails" not in done, done
        return done["result"].get("value")


MODEL = """
const listeners = {}, state = {}, changed = {};
const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const model = {
  get: (trait) => state[trait],
  set: (trait, value) => { state[trait] = changed[trait] = value; },
  on: (event, what) => (listeners[event] ??= []).push(what),
  save_changes: () => {
    toPython(JSON.stringify(changed));
    for (const trait in changed) delete changed[trait];
  },
};
function put(traits) {  // from Python
  for (const [trait, value] of Object.entries(traits))
    state[trait] = trait === "picture" ? bytes(value) : value;
  for (const trait in traits) for (const what of listeners[`change:${trait}`] ?? []) what();
}
"""


@pytest.fixture
def page(tmp_path):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if not browser:
        pytest.skip("no Chromium")
    page = Page(browser, tmp_path)
    page.send("Runtime.enable")
    page.send("Runtime.addBinding", name="toPython")
    yield page
    os.close(page.to)  # ends it
    page.browser.wait(30)
    os.close(page.answers)


def test_in_a_browser_a_drag_turns_a_slider_focuses_and_pictures_follow(view, page):
    names = "focus view aperture rotation drag picture message depths".split()

    def exchange():
        """What the page has asked for goes to the widget, and its answer to the page."""
        page.run("new Promise((done) => setTimeout(done, 100))")
        for asked in page.calls:
            view.set_state(asked)
        page.calls.clear()
        traits = {name: getattr(view, name) for name in names}
        traits["picture"] = base64.b64encode(traits["picture"]).decode()
        page.run(f"put({json.dumps(traits)}); document.querySelector('img')?.decode()")

    def is_shown():
        """Whether the page's picture has the pixels of the widget's."""
        rgba = page.run("""(() => {
          const img = document.querySelector("img"), canvas = document.createElement("canvas");
          const size = [canvas.width, canvas.height] = [img.naturalWidth, img.naturalHeight];
          const paper = canvas.getContext("2d");
          paper.drawImage(img, 0, 0);
          return Array.from(paper.getImageData(0, 0, ...size).data);
        })()""")
        light = seen(view.picture)
        return np.allclose((np.reshape(rgba, (*light.shape, 4))[..., 0] / 255) ** 2.2, light)

    page.run(MODEL)
    exchange()
    module = base64.b64encode(view._esm.encode()).decode()
    page.run(f"""import("data:text/javascript;base64,{module}")
        .then((it) => it.default.render({{model, el: document.body}}))""")
    exchange()
    assert is_shown()
    first = view.picture
    x, y, height = page.run("""(({x, y, width, height}) => [x + width / 2, y + height / 2, height])
        (document.querySelector("img").getBoundingClientRect())""")
    for kind, share in (("Pressed", 0), ("Moved", 1 / 4), ("Moved", 1 / 3), ("Released", 1 / 3),
                        ("Moved", 0)):  # the last turns nothing any more
        page.send("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x + share * height,
                  y=y - share * height / 2, button="left", clickCount=1,
                  buttons=int(kind == "Pressed" or share > 0))
    exchange()
    assert view.drag == pytest.approx((30, 60), abs=0.5)  # up and to the right
    assert view.picture != first and is_shown()
    assert page.run("document.body.innerText").strip().endswith(view.message)

    page.run("""(([slider]) => { slider.value = 18.5; slider.dispatchEvent(new Event("input")); })
        (document.querySelectorAll("input"))""")
    exchange()
    assert view.focus == pytest.approx(18.5e-3, abs=1e-5) and is_shown()
    assert "focus, mm: 18.5" in page.run("document.body.innerText")
