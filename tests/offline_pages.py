"""Addresses beyond a page that it names, fetches or could send something to."""

import re
from html.parser import HTMLParser
from pathlib import Path

FETCHED = [
    "src",
    "srcset",
    "href",
    "xlink:href",
    "action",
    "formaction",
    "data",
    "poster",
    "ping",
]
NEAR = ("#", "data:")
CLOSED = "default-src 'none'"
# what a page in the browser holds of buttons of the chart library, and of ways out
BUTTONS = "document.querySelectorAll('.modebar, .modebar-btn').length"
WAYS_OUT = """names => [...document.querySelectorAll('*')]
    .flatMap(node => [...node.attributes]).filter(one => names.includes(one.name))
    .map(one => one.value).filter(value => !/^(#|data:)/.test(value))"""


class Outward(HTMLParser):
    """Collects what the tags and the styles of a page name that is not in the page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.policies: list[str] = []
        self.tag = ""

    def handle_starttag(self, tag, attrs):
        values = {name: value or "" for name, value in attrs}
        self.tag = tag
        self.found += [
            value
            for name, value in values.items()
            if name in FETCHED and not value.startswith(NEAR)
        ]
        self._take_style(values.get("style", ""))
        if values.get("http-equiv") == "Content-Security-Policy":
            self.policies.append(values["content"])

    def handle_endtag(self, tag):
        self.tag = ""

    def handle_data(self, data):
        if self.tag == "style":
            self._take_style(data)

    def _take_style(self, style):
        self.found += re.findall(r"@import[^;]*|url\((?![\"']?data:)[^)]*\)", style)


def outward(text: str) -> list[str]:
    """Addresses that the markup and the styles of a page name outside of it.

    A page without a policy that forbids every fetch counts as one.
    """
    page = Outward()
    page.feed(text)
    closed = [policy for policy in page.policies if policy.startswith(CLOSED)]
    if not closed:
        page.found.append("no policy that forbids to fetch")
    return page.found


def sent_by(browser, path: Path) -> dict[str, object]:
    """Requests, ways out, buttons and complaints of a page that is opened with the network cut.

    The mouse has been over every chart, where a bar of buttons would come up.
    """
    context = browser.new_context(offline=True)
    page = context.new_page()
    asked: list[str] = []
    said: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(path.as_uri())
    for chart in page.query_selector_all(".plot .nsewdrag"):
        chart.scroll_into_view_if_needed()
        chart.hover(force=True)
    seen = {
        "asked": [url for url in asked if not url.startswith(("data:", path.as_uri()))],
        "ways_out": page.evaluate(WAYS_OUT, FETCHED),
        "buttons": page.evaluate(BUTTONS),
        "said": said,
    }
    context.close()
    return seen


NOTHING = {"asked": [], "ways_out": [], "buttons": 0, "said": []}
