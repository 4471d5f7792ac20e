"""What a page holds, as its parser sees it."""

import html.parser

VOID = {"meta", "br", "img", "link"}


class Page(html.parser.HTMLParser):
    """The elements of a page, its words, and the cells of its tables, a list of rows for each; nothing is a script."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.ids, self.words, self.tags, self.tables = [], [], [], [], set(), []
        self.feed(text)

    @property
    def cells(self):
        return [cell for table in self.tables for row in table for cell in row]

    def handle_starttag(self, tag, attrs):
        self.ids += [value for name, value in attrs if name == "id"]
        self.links += [value for name, value in attrs if name in ("src", "href", "xlink:href", "action", "data")]
        self.tags.add(tag)
        assert tag != "script"
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)
        if self.open and self.open[-1] in ("td", "th"):
            self.tables[-1][-1][-1] += data
