"""The page's buttons in a real Chromium: when they may be pressed, what is said when not, and STOP whatever
else fails.
"""

import pytest
from page_in_chromium import Page
from page_rig import ONE_AXIS, asked, held_back, served, serving
from patience import until

from rtctl.client.view_server import ViewServer
from rtctl.control.vocabulary import State

pytestmark = [pytest.mark.system, pytest.mark.timeout(200)]


def test_buttons_follow_the_state_and_say_why_they_are_held_back(desk):
    page, rig, _server = desk
    held_back(page, "reset")
    page.becomes("document.querySelector('[data-do=arm]').classList.contains('lead')")
    page("document.querySelector('[data-do=reset]').click()")
    page.becomes("document.getElementById('notice').textContent.includes('nothing to reset in IDLE')")
    assert asked(rig, "reset") == 0
    page("document.querySelector('[data-do=arm]').focus()")
    page.key("Enter")
    until(lambda: asked(rig, "arm"), "the press")
    rig.be(State.ACTIVE)
    page.state("ACTIVE")
    held_back(page, "arm", "reset", "tare")
    assert page("document.activeElement.dataset.do") == "arm", "the keyboard does not lose its place"
    rig.be(State.FAULT, fault_first=0)
    page.state("FAULT")
    held_back(page, "arm")
    page.becomes("document.querySelector('[data-do=reset]').classList.contains('lead')")


def test_a_refusal_is_shown_and_vanishes_with_the_next_change_of_state(desk):
    page, rig, _server = desk
    rig.refuse = "the force is not tared yet"
    page("document.querySelector('[data-do=arm]').click()")
    page.becomes(
        "seen(document.getElementById('notice')) && "
        "document.getElementById('notice').textContent.includes('not tared yet')"
    )
    rig.refuse = None
    rig.be(State.ACTIVE)
    page.becomes("document.getElementById('notice').hidden")


def test_a_tare_refused_for_a_pull_is_asked_for_again_by_a_second_press_that_is_no_double_click(desk):
    page, rig, _server = desk
    rig.refuse = (
        "the force sensor shows 0.3 N m; if nobody touches the device, say so: rtctl tare --hands-off"
    )
    tare = "document.querySelector('[data-do=tare]')"
    # its clock is the test's: a double click is one within a second, however long this machine stands still
    page("window.now = performance.now(); performance.now = () => now")
    page(f"{tare}.click()")
    page.becomes("document.getElementById('notice').textContent.includes('shows 0.3 N m')")
    page.becomes(f"{tare}.textContent === 'Tare: nobody touches it'")
    rig.refuse = None
    page("window.real = fetch; window.fetch = () => failures.push('it asked')")
    page(f"{tare}.click()")
    assert page("failures") == [], "a double click"
    page(f"window.fetch = real; now += 1100; {tare}.click()")
    until(lambda: asked(rig, "tare"), "the second press")
    assert ("tare", (), {"hands_off": True}) in rig.asked
    # by its clock, which has jumped, no data may have come for a while
    page.becomes(f"{tare}.textContent === 'Tare' && {tare}.ariaDisabled === 'false'")
    page(f"{tare}.click()")
    until(lambda: asked(rig, "tare") == 2, "the next tare")
    assert ("tare", (), {"hands_off": False}) in rig.asked


def test_escape_stops_from_anywhere_and_a_stop_that_does_not_arrive_is_said_above_all(desk):
    page, rig, _server = desk
    rig.be(State.ACTIVE)
    page.state("ACTIVE")
    page("document.getElementById('add').focus()")
    page.key("Escape")
    until(lambda: asked(rig, "stop") == 1, "the stop")
    rig.refuse = "no reply"
    page.key("Escape")
    page.becomes("document.querySelector('#alert strong').textContent === 'STOP NOT CONFIRMED'")
    assert "emergency stop" in page("document.querySelector('#alert .remedy').textContent")
    rig.refuse = None
    rig.be(State.STOPPING)
    page.becomes("document.getElementById('alert').hidden")


def test_an_answer_to_an_earlier_press_does_not_hide_that_the_last_stop_failed(desk):
    page, rig, _server = desk
    rig.be(State.ACTIVE)
    page.state("ACTIVE")
    page(
        "window.held = []; window.real = fetch; window.fetch = (path, more) =>"
        " path === '/do/stop' ? new Promise((answer) => held.push((said) => answer(new "
        "Response(JSON.stringify(said))))) : real(path, more)"
    )
    page.key("Escape")
    page.becomes("held.length === 1")
    page.key("Escape")
    page.becomes("held.length === 2")
    page("held[1]({ error: 'no reply' })")
    page.becomes("document.querySelector('#alert strong').textContent === 'STOP NOT CONFIRMED'")
    page("held[0]({ ok: true }); window.later = false; setTimeout(() => { later = true; }, 500)")
    page.becomes("later")
    assert page("document.querySelector('#alert strong').textContent") == "STOP NOT CONFIRMED"
    assert page("seen(document.getElementById('alert'))")


def test_more_windows_than_a_browser_has_connections_for_do_not_keep_stop_waiting(chromium, rig):
    made, server = rig
    made.be(State.ACTIVE)
    pages = [Page(chromium, f"{server.url}world", "desk", "light") for _ in range(4)]
    for page in pages:
        page.state("ACTIVE")
    more = [Page(chromium, server.url, "desk", "light", settled=False) for _ in range(3)]
    for page in more:
        page.becomes("alert_says('four windows')")
    more[-1].key("Escape")
    until(lambda: asked(made, "stop") == 1, "the stop")
    pages[0].close()
    until(lambda: "ACTIVE" in [page("document.getElementById('state').textContent") for page in more], "room")
    for page in pages[1:] + more:
        page.close()


def test_a_page_whose_server_ends_says_so_and_comes_back_with_it(chromium, rig):
    made, _server = rig
    first = ViewServer(made, "127.0.0.1", 0)
    port = first.server_address[1]
    with serving(first):
        page = Page(chromium, first.url, "desk", "light")
        page.state("IDLE")
    page.state("NO DATA")
    page.becomes('alert_says("the page\'s server")')
    with serving(ViewServer(made, "127.0.0.1", port)):
        page.state("IDLE")
        page.becomes("document.getElementById('alert').hidden && !document.body.classList.contains('stale')")
        page.close()


def test_without_the_key_only_stop_is_offered_and_foreign_text_stays_text(chromium):
    evil = '<img src=x onerror="failures.push(1)">'
    with served({**ONE_AXIS, "axes": [{"name": evil}]}) as (rig, server):
        page = Page(chromium, server.url, "phone", "dark")
        page.becomes("!document.getElementById('nokey').hidden && seen(document.getElementById('stop'))")
        rig.told.put(
            {
                "event": "device",
                "device": evil,
                "axis": None,
                "text": evil,
                "faults": [],
                "silent": True,
                "timestamp": 1.0,
                "tick": 1,
            }
        )
        rig.well.put(
            {"devices": [{"device": evil, "axis": None, "text": evil, "faults": [], "silent": True}]}
        )
        page.becomes(
            "document.getElementById('events').textContent.includes('<img') && "
            "document.getElementById('alert').textContent.includes('<img')"
        )
        assert page("document.querySelector('#axes tbody th').textContent") == evil
        assert page("document.images.length") == 0
        assert (
            page(
                "document.getElementById('operator').checkVisibility() || "
                "document.getElementById('help').checkVisibility()"
            )
            is False
        )
        page.close()
