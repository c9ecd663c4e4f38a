"""A page of the live view in a real Chromium, as a person sees it and uses it by keyboard."""

import base64
import json

SIZES = {"desk": (1400, 900), "phone": (390, 844)}
KEYS = {"Tab": 9, "Escape": 27, "Enter": 13, "ArrowLeft": 37, "End": 35}

HELPERS = """
window.failures = [];
addEventListener("error", (event) => failures.push(event.message));
addEventListener("unhandledrejection", (event) => failures.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => failures.push("policy: " + event.blockedURI));
// Whether an element is on the screen, and nothing lies over it.
window.seen = (element) => {
  if (!element || !element.checkVisibility()) return false;
  const box = element.getBoundingClientRect();
  if (box.top < 0 || box.left < 0 || box.bottom > innerHeight || box.right > innerWidth) return false;
  const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
  return element.contains(top) || top.contains(element);
};
window.named = (element) => element.id || element.dataset.do || element.getAttribute("href")
  || element.getAttribute("aria-label") || element.textContent.trim();
window.controls = () => [
  ...document.querySelectorAll('a[href], button, select, input, summary, [tabindex="0"]'),
].filter((one) => one.checkVisibility());
window.alert_says = (text) => document.getElementById("alert").textContent.includes(text);
window.kind_of_world = (name) =>
  [...document.querySelectorAll("#kinds button")].find((one) => one.textContent === name);
// Text whose contrast is below 4.5 to 1 (3 to 1 where it is large or bold), but what is held back or old.
window.faint = () => {
  const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
  const light = (c) => c.slice(0, 3).map((v) => v / 255)
    .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (one) => {
    for (let at = one; at; at = at.parentElement) {
      const c = numbers(getComputedStyle(at).backgroundColor);
      if (c.length < 4 || c[3] === 1) return c;
    }
    return [255, 255, 255];
  };
  return [...document.querySelectorAll("body *")].filter(
    (one) => [...one.childNodes].some((n) => n.nodeType === 3 && n.data.trim())
      && one.checkVisibility() && !one.closest("[aria-disabled=true], option, script"),
  ).map((one) => {
    const style = getComputedStyle(one);
    const [a, b] = [light(numbers(style.color)), light(behind(one))].sort((x, y) => y - x);
    const needed = parseFloat(style.fontSize) >= 18.6 && style.fontWeight >= 700 ? 3 : 4.5;
    return [(a + 0.05) / (b + 0.05), needed, one.textContent.trim().slice(0, 40)];
  }).filter(([ratio, needed]) => ratio < needed);
};
"""


class Page:
    """One tab, as a person sees and uses it."""

    def __init__(self, opened, url, size, theme, *, settled=True):
        self._browser = opened
        width, height = SIZES[size]
        self._session = opened.page("about:blank", width, height)
        self._ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=size == "phone",
        )
        self._ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
        self._ask("Page.enable")
        self._ask("Page.addScriptToEvaluateOnNewDocument", source=HELPERS)
        self._ask("Page.navigate", url=url)
        if settled:
            self.settle()

    def _ask(self, method, **params):
        return self._browser.ask(method, self._session, **params)

    def go(self, url):
        self._ask("Page.navigate", url=url)
        self.becomes(f"location.href.startsWith({json.dumps(url)})")
        self.settle()

    def settle(self):
        """Until data are shown."""
        self.becomes(
            "document.querySelectorAll('.badge:not(.NO-DATA)').length && "
            "document.getElementById('state').textContent !== 'connecting'"
        )

    def __call__(self, expression):
        return self._browser.evaluate(self._session, expression)

    def becomes(self, expression):
        return self._browser.wait_for(self._session, expression)

    def key(self, name):
        for kind in ("keyDown", "keyUp"):
            text = {"text": "\r"} if name == "Enter" and kind == "keyDown" else {}
            self._ask(
                "Input.dispatchKeyEvent",
                type=kind,
                key=name,
                code=name,
                windowsVirtualKeyCode=KEYS[name],
                **text,
            )

    def state(self, wanted):
        self.becomes(f"document.getElementById('state').textContent === {json.dumps(wanted)}")

    def picture(self, path):
        path.write_bytes(base64.b64decode(self._ask("Page.captureScreenshot")["data"]))

    def module(self, name):
        """A script of the page, under its name from now on."""
        self(f"import('/{name}.js').then((module) => {{ window.{name} = module; }})")
        self.becomes(f"!!window.{name}")

    def close(self):
        assert self("failures") == []
        self._browser.close(self._session)
