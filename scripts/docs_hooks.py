"""What the docs site adds to Markdown: equations as MathML, help of the commands, examples, reports not made yet."""

import html as markup
import re
from pathlib import Path

import latex2mathml.converter
from mkdocs.structure.files import File

#: Reports that a command makes; until it has run there is a page that says so.
REPORTS = {
    "accuracy.md": ("Accuracy", "gush accuracy"),
    "stability.md": ("Stability", "gush stability"),
    "performance.md": ("Performance", "gush bench"),
    "published.md": ("The published study", "gush published"),
}
EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
#: Functions, around which TeX leaves a thin space and MathML from it does not.
FUNCTION = re.compile(r"\\(sin|cos|tan|cot)(\^2)?(?![a-z])")
#: Cross-references of docstrings, whose roles Markdown does not know: ":func:`name`".
ROLE = re.compile(r":(?:func|class|meth|mod|data|attr):(?=<code|<a|`)")


def on_files(files, config):
    """Add a page for every report that has not been made."""
    for name, (title, command) in REPORTS.items():
        if files.get_file_from_path(name) is None:
            text = f"# {title}\n\nThis report is made by `{command}`; it has not been made for this revision.\n"
            files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown, page, **_):
    """Put the help of every command and the text of the examples on their pages."""
    if page.file.src_uri == "reference/commands.md":
        return markdown.replace("<!-- commands -->", commands())
    if page.file.src_uri == "examples.md":
        return re.sub("<!-- example (.*) -->", _example, markdown)
    return markdown


def _example(match):
    text = (Path(__file__).parent.parent / "examples" / match[1]).read_text(encoding="utf-8")
    return f"```python\n{text}```"


def on_page_content(html, **_):
    """Equations as MathML, which browsers show without a script; no roles."""
    return EQUATION.sub(_mathml, ROLE.sub("", html))


def _mathml(match):
    equation = FUNCTION.sub(r"\\,\\\1\2\\,", markup.unescape(match[3]))
    return latex2mathml.converter.convert(equation, display="block" if match[2] == "[" else "inline")


def commands():
    """Help of all commands as Markdown."""
    import typer

    from coupling.cli import app

    group = typer.main.get_command(app)
    parts = []
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        context = typer.Context(command, info_name=f"gush {name}")
        text = command.get_help(context)
        parts.append(f"## gush {name}\n\n```text\n{_plain(text)}\n```\n")
    return "\n".join(parts)


def _plain(text):
    return "\n".join(line.rstrip() for line in text.strip().splitlines())
