"""Pages of docs/ keep their word: Python blocks run and print what stands below them, TOML blocks load."""

import contextlib
import doctest
import io
import re
import tomllib
from pathlib import Path

import pytest

from smid.models import ModelError, load_model, model_from_mapping
from smid.models.file import MODEL_CLASSES, _fields

ROOT = Path(__file__).parents[2]
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").glob("*.md"))}
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)


LINK = re.compile(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)")


def blocks(page, *languages):
    """Return language and text of a page's blocks in these languages."""
    return [found.groups() for found in BLOCK.finditer(PAGES[page]) if found[1] in languages]


def test_links_lead_to_files():
    pages = [*(ROOT / "docs").glob("*.md"), *(ROOT / "notebooks").glob("*.md"), *(ROOT / "notebooks").glob("*.py")]
    links = {(page, link) for page in pages for link in LINK.findall(page.read_text(encoding="utf-8"))}
    assert len(links) > 20
    assert [(page.name, link) for page, link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", [name for name in PAGES if blocks(name, "python")])
def test_python_prints_what_the_page_says(page, tmp_path, monkeypatch):
    # Pages read data/ and write files of their own: in a folder that has the one and keeps the others.
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    names, printed = {"__name__": page}, ""
    for language, text in blocks(page, "python", "text"):
        if language == "python":
            assert not printed, f"nothing on the page shows what was printed:\n{printed}"
            with contextlib.redirect_stdout(io.StringIO()) as output:
                exec(compile(text, f"{page}.md", "exec"), names)
            printed = output.getvalue()
        else:
            same = doctest.OutputChecker().check_output(text, printed, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
            assert same, f"the page says\n{text}\nbut this is printed\n{printed}"
            printed = ""
    assert not printed, f"nothing on the page shows what was printed:\n{printed}"


@pytest.mark.parametrize("text", [text for _, text in blocks("model-files", "toml")])
def test_model_files_of_the_page_load(text, tmp_path):
    (tmp_path / "model.toml").write_text(text, encoding="utf-8")
    assert load_model(tmp_path / "model.toml").parameters


def test_mistakes_of_the_page_are_told_as_it_says():
    mistakes = re.findall(r"^\| `(.+?)` \| (.+?) \|$", PAGES["model-files"].split("## Mistakes")[1], flags=re.MULTILINE)
    assert len(mistakes) > 3
    for lines, words in mistakes:
        with pytest.raises(ModelError) as told:
            model_from_mapping(tomllib.loads(lines.replace("; ", "\n")))
        assert words.strip("`") in str(told.value)


def test_every_field_is_on_the_page_under_its_class():
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", PAGES["model-files"], flags=re.MULTILINE | re.DOTALL))
    shared = {name: re.findall(r"^\| `(\w+)` \|", text, flags=re.MULTILINE) for name, text in sections.items()}
    for name, build in MODEL_CLASSES.items():
        listed = set(shared[name])
        if "priors" in sections[name]:
            listed |= set(shared["Priors"])
        assert listed == set(_fields(build)), name
