"""The page in a real Chromium at a desk's and a phone's size, in the light and in the dark: what is seen, and
what a keyboard reaches.

The rig is made up (`made_up_rig`): it is in the state that the test wants. Pictures are kept in the test's
folder.
"""

import json

import pytest
from made_up_rig import HELLO
from page_in_chromium import Page
from page_rig import ONE_AXIS, asked, fault, served
from patience import until

from rtctl.control.vocabulary import Environment, Fault, State

pytestmark = [pytest.mark.system, pytest.mark.timeout(200)]

LOOKS = [(size, theme) for size in ("desk", "phone") for theme in ("light", "dark")]


@pytest.mark.parametrize(("size", "theme"), LOOKS)
@pytest.mark.parametrize("path", ["", "world"])
def test_every_control_is_reached_by_keyboard_and_faults_are_seen_without_scrolling(
    chromium, rig, tmp_path, path, size, theme
):
    made, server = rig
    page = Page(chromium, f"{server.url}{path}#key=right", size, theme)
    page.state("IDLE")
    page.picture(tmp_path / "idle.png")
    assert page("faint()") == []
    keyboard_reaches_everything(page, path)
    page("scrollTo(0, 0)")
    made.be(State.ACTIVE, environment_kind=Environment.WALL)
    page.state("ACTIVE")
    page.picture(tmp_path / "active.png")
    fault(made)
    page.state("FAULT")
    page.becomes("alert_says('device[0]')")  # ticks and events come apart
    page.picture(tmp_path / "fault.png")
    fault_remedy_and_stop_are_seen(page)
    made.silence()
    page.state("NO DATA")
    page("scrollTo(0, 0)")
    page.picture(tmp_path / "no-data.png")
    assert page("alert_says('FAULT (STALE)')")
    assert float(page("getComputedStyle(document.getElementById('axes')).opacity")) < 0.7
    assert page("seen(document.getElementById('stop'))")
    page.close()


def keyboard_reaches_everything(page, path):
    if path:
        page("kind_of_world('wall').click()")
        page.becomes("document.querySelectorAll('#sliders input').length === 3")
    else:
        page.becomes("controls().length > 15")
        page("document.getElementById('phase').open = true")
    wanted, reached = page("controls().map(named)"), []
    assert {"stop", "arm", "reset", "tare"} <= set(wanted)
    for _ in wanted:
        page.key("Tab")
        reached.append(page("named(document.activeElement)"))
        assert page("seen(document.activeElement) || document.activeElement.id === 'scopes'"), (
            f"{reached[-1]} is hidden"
        )
        assert page("getComputedStyle(document.activeElement).outlineStyle") == "solid", reached
    assert reached[0] == "stop"
    assert sorted(reached) == sorted(wanted)


def fault_remedy_and_stop_are_seen(page):
    assert page("scrollY") == 0
    for seen in (
        "#stop",
        "#state",
        "#next",
        "#alert strong",
        "#alert .wrong",
        "#alert .remedy",
        "[data-do=reset]",
    ):
        assert page(f"seen(document.querySelector({json.dumps(seen)}))"), seen
    for part in (
        "stopped by STALE",
        "axis joint",
        "no fresh sample for 3 ticks",
        "check its power",
        "also CHECKSUM",
    ):
        assert page(f"alert_says({json.dumps(part)})"), part
    assert page("faint()") == []
    assert page("document.documentElement.scrollWidth <= innerWidth")
    page("scrollTo(0, 1e6)")
    page.becomes("seen(document.getElementById('stop')) && seen(document.getElementById('state'))")


def test_the_scope_names_states_shares_its_time_and_keeps_its_layout(desk):
    page, _rig, server = desk
    page.module("scope")
    assert page("document.querySelector('.scope output').textContent") == "IDLE"
    assert page("new Set(scope.scopes.map((one) => one.plot.bbox.left)).size") == 1, (
        "the curves stand below each other"
    )
    assert page("scope.scopes.filter((one) => one.plot.axes[0].label).length") == 1
    page(
        "document.getElementById('add').value = 'velocity_rad_s.0'; "
        "document.getElementById('add').dispatchEvent(new Event('change'))"
    )
    page.becomes("scope.scopes.length === 5 && scope.data['velocity_rad_s.0']?.some((v) => v !== null)")
    page("document.querySelector('.scope .remove').click()")
    page(
        "document.getElementById('window').value = '5'; "
        "document.getElementById('window').dispatchEvent(new Event('change'))"
    )
    page("document.getElementById('scopes').focus()")
    page.key("ArrowLeft")
    page.becomes("document.getElementById('pause').textContent === 'Go on'")
    page.becomes("scope.scopes[0].plot.scales.x.max > 0")  # drawn once: before, every scale is null alike
    page.becomes(
        "new Set(scope.scopes.map((one) => one.plot.scales.x.min + ' ' + one.plot.scales.x.max)).size === 1"
    )
    held = page("scope.scopes[0].plot.scales.x.max")
    end = page("scope.data.t.at(-1)")
    page.becomes(f"scope.data.t.at(-1) > {end} + 0.3")
    assert page("scope.scopes[0].plot.scales.x.max") == held, "the picture is held while data come"
    page.key("End")
    page.becomes(f"scope.scopes[0].plot.scales.x.max > {held}")
    page.go(server.url + "?again")
    page.module("scope")
    page.becomes("scope.scopes.length === 4")
    assert page("scope.scopes.map((one) => one.name)")[-1] == "velocity_rad_s.0"
    assert page("document.getElementById('window').value") == "5"


def test_one_signal_is_drawn_over_another(desk):
    page, rig, _server = desk
    rig.be(State.ACTIVE)
    page("document.getElementById('phase').open = true")
    inked = """(() => {
      const canvas = document.getElementById('phase-plot'), draw = canvas.getContext('2d');
      const blue = [29, 78, 216];
      if (!canvas.width) return 0;
      const d = draw.getImageData(0, 0, canvas.width, canvas.height).data; let n = 0;
      for (let k = 0; k < d.length; k += 4)
        n += d[k + 3] === 255 && blue.every((v, i) => Math.abs(d[k + i] - v) < 6);
      return n > 200; })()"""
    page.becomes(inked)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_grid_is_visible(chromium, rig, theme):
    page = Page(chromium, rig[1].url, "desk", theme)
    contrast = """(() => {
      const light = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255)
        .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
        .reduce((s, v, k) => s + v * [0.2126, 0.7152, 0.0722][k], 0);
      const of = (name) => light(getComputedStyle(document.documentElement).getPropertyValue('--' + name)
        .trim().replace(/^#(.)(.)(.)$/, '#$1$1$2$2$3$3'));
      const pair = (a, b) => (Math.max(of(a), of(b)) + 0.05) / (Math.min(of(a), of(b)) + 0.05);
      return [pair('grid', 'card'), ...[0, 1, 2, 3, 4, 5].map((k) => pair('curve-' + k, 'card'))]; })()"""
    grid, *curves = page(contrast)
    assert grid > 1.25
    assert min(curves) > 4.5
    page.module("scope")
    page.becomes("scope.scopes[0]?.plot")
    assert page("scope.scopes[0].plot.axes[0].grid.stroke()") == page(
        "getComputedStyle(document.documentElement).getPropertyValue('--grid').trim()"
    )
    page.close()


def test_a_recording_is_saved_with_every_tick(chromium, desk, tmp_path):
    page, _rig, _server = desk
    chromium.ask("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page("document.getElementById('record').click()")
    page.becomes("/ 0\\.[1-9] MB/.test(document.getElementById('recorded').textContent)")
    page("document.getElementById('record').click()")
    page.becomes("document.getElementById('notice').textContent.includes('Saved mock-')")
    (path,) = until(
        lambda: [one for one in tmp_path.iterdir() if one.suffix == ".csv" and one.stat().st_size], "the file"
    )
    head, *lines = path.read_text().splitlines()
    assert head == "tick,time_ns,state,position_rad.joint,hand_torque_nm.joint,torque_applied_nm.joint"
    ticks = [int(line.partition(",")[0]) for line in lines]
    assert len(ticks) > 1000
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))


def test_the_world_names_its_axis_and_says_what_its_colours_mean(chromium):
    with served(HELLO) as (rig, server):
        page = Page(chromium, f"{server.url}world#key=right", "desk", "light")
        page("kind_of_world('spring').click()")
        until(lambda: asked(rig, "set_environment"), "the spring")
        rig.be(State.ACTIVE, environment_kind=Environment.SPRING)
        page.becomes("document.getElementById('legend').textContent.includes('spring')")
        legend = page("document.getElementById('legend').textContent")
        assert "joint" in legend
        assert "torque of the hand" in legend
        assert "virtual object" in legend
        assert page("document.getElementById('axis').textContent") == "Acts on axis yaw, the first of 2."
        assert page("[...document.querySelectorAll('#axes tbody th')].map((one) => one.textContent)") == [
            "yaw",
            "pitch",
        ]
        assert rig.asked[-1][1][0] == "yaw"
        page.close()


def test_stop_stays_in_its_corner_whatever_else_the_head_says(chromium):
    with served({**ONE_AXIS, "rig": "a-rig-with-a-name-of-32-letters-"}) as (rig, server):
        rig.be(State.FAULT, faults=int(Fault.STALE), fault_first=0, waiver=1, lease_held=1)
        page = Page(chromium, server.url, "desk", "light")
        page.state("FAULT")
        page("document.querySelector('[data-do=arm]').click()")  # a notice
        page.becomes("seen(document.getElementById('notice')) && alert_says('STALE')")
        for _ in range(2):
            corner = page(
                "(() => { const box = document.getElementById('stop').getBoundingClientRect(); return "
                "[innerWidth - box.right, box.top]; })()"
            )
            assert max(corner) < 40
            assert page("seen(document.getElementById('stop'))")
            page("scrollTo(0, 1e6)")
        page.close()


SLIDE = {
    **HELLO,
    "rig": "slide",
    "axes": [
        {
            "name": "carriage",
            "motion": "linear",
            "bounds": {"position_rad": [-0.2, 0.2]},
            "coupling": {"stiffness_nm_rad": 6000.0, "damping_nms_rad": 1.0},
        }
    ],
}


@pytest.mark.parametrize("path", ["", "world"])
def test_a_linear_axis_is_a_carriage_on_a_rail_in_metres(chromium, tmp_path, path):
    with served(SLIDE) as (made, server):
        page = Page(chromium, f"{server.url}{path}#key=right", "desk", "light")
        made.be(State.ACTIVE, environment_kind=Environment.WALL)
        page.state("ACTIVE")
        page.becomes("document.querySelector('#axes tbody tr')")
        assert page("[...document.querySelectorAll('#axes thead small')].map((one) => one.textContent)") == [
            "m",
            "m/s",
            "N",
            "N",
        ]
        assert page("document.getElementById('legend').textContent").startswith("carriageforce of the hand")
        if path:
            page("kind_of_world('wall').click()")
            page.becomes("document.querySelectorAll('#sliders output').length === 3")
            told = page("[...document.querySelectorAll('#sliders output')].map((one) => one.textContent)")
            assert told == ["2000 N/m", "2.00 N s/m", "0.00 m"]
        else:
            shown = page("[...document.querySelectorAll('#scopes h3')].map((one) => one.textContent)")
            assert shown[1].startswith("position_m · carriage")
            assert shown[1].rstrip("×").endswith(" m")
        # the carriage stands where its position is: 0.1 m is three quarters of the way along the rail
        page.module("scene")
        page(
            """
            window.asked = [];
            const canvas = document.getElementById("scene"), real = canvas.getContext.bind(canvas);
            canvas.getContext = (kind) => new Proxy(real(kind), {
              get: (draw, name) => name === "fillRect" ? (...box) => asked.push(box)
                : typeof draw[name] === "function" ? draw[name].bind(draw) : draw[name],
              set: (draw, name, value) => { draw[name] = value; return true; },
            });
            scene.drawScene(canvas, { axes: ["carriage"],
              facts: [{ name: "carriage", motion: "linear", travel: [-0.2, 0.2] }], environment: ["free"],
              proxy_rad: [0], position_rad: [0.1], hand_nm: [3] });
            delete canvas.getContext;
            """
        )
        left, _, wide, _ = page("asked")[0]
        whole = page("document.getElementById('scene').clientWidth")
        assert left + wide / 2 == pytest.approx(whole * (0.5 + 0.42 * 0.5), abs=1)
        page.picture(tmp_path / "carriage.png")
        page.close()
