"""Pages in Markdown: what comes from a file stays text."""

from analysis.report.markdown import markdown_page
from shiplog.text_table import TextTable


def test_text_of_a_file_adds_no_line_no_link_and_no_image() -> None:
    hostile = "a\n# b ![x](http://x) [y\\](http://y) <img src=x> | c\u202e\x1b[2J"
    table = TextTable(hostile, ("n\n[deg/s]", hostile), ((hostile, "1"),), (hostile,))
    page = markdown_page(hostile, [table], [hostile])
    plain = markdown_page("a", [TextTable("a", ("n", "b"), (("a", "1"),), ("a",))], ["a"])
    assert page.count("\n") == plain.count("\n")
    assert page.replace("\n", "").isprintable()
    assert "](" not in page.replace("\\](", "")
    assert "<" not in page.replace("\\<", "")
    assert "\\\\\\](http://y)" in page  # backslash and bracket are both escaped
    assert "[deg/s]" in page
    row = page.splitlines()[-3]
    assert row.count("|") - row.count("\\|") == 3
