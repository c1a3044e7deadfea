"""The words of the page in several languages."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from ptmtools.site.content import Site
from ptmtools.site.words import LANGUAGES, words_of

WEB = Path(__file__).parents[2] / "web" / "page"
FILES = Path(__file__).parents[2] / "ptmtools" / "site" / "words"
OTHERS = LANGUAGES[1:]


def texts_of(words: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Section and name → text."""
    for key, value in words.items():
        if isinstance(value, str):
            yield f"{name}{key}", value
        else:
            yield from texts_of(value, f"{key}.")


def fields_of(text: str) -> list[str]:
    return sorted(re.findall(r"\{\w+\}", text))


def test_each_file_is_a_language_that_page_and_catalogue_know() -> None:
    assert {file.stem for file in FILES.glob("*.json")} == set(LANGUAGES)
    script = (WEB / "words" / "language.js").read_text()
    assert f'OTHERS = "{" ".join(OTHERS)}"' in script
    assert words_of("de-AT") == words_of("de") != words_of("en")
    assert words_of("xx") == words_of("en")


@pytest.mark.parametrize("language", OTHERS)
def test_languages_have_the_same_names_and_fields(language: str) -> None:
    english, own = dict(texts_of(words_of("en"))), dict(texts_of(words_of(language)))
    assert own.keys() == english.keys()
    for name, text in own.items():
        assert text, name
        assert fields_of(text) == fields_of(english[name]), name
    assert own["direction"] in ("ltr", "rtl")


def test_each_english_word_has_one_translation() -> None:
    """The texts of the page as it is sent are looked up by their English."""
    markup = words_of("en")["markup"]
    assert len(set(markup.values())) == len(markup)


def test_the_module_of_the_english_words_is_written() -> None:
    """`web/page/build.py` writes it."""
    script = (WEB / "words" / "english.js").read_text()
    for name, texts in words_of("en").items():
        if isinstance(texts, dict) and name != "catalogue":
            text = json.dumps(texts, ensure_ascii=False, indent=2)
            assert f'export const {name} = /* @__PURE__ */ own("{name}", {text});' in script


def test_the_page_is_in_the_language_of_the_address(
    visit: Callable[..., Any], museum: Site
) -> None:
    with visit(museum, query="?lang=de#1e6,0,0,0", locale="fr-FR") as visitor:
        page, words = visitor.page, words_of("de")
        page.get_by_text(words["page"]["outside"]).wait_for()
        assert page.evaluate("[document.documentElement.lang, document.documentElement.dir]") == [
            "de",
            "ltr",
        ]
        names = ["places", "map", "copyLink", "details", "help"]
        buttons = page.locator("nav button").all_inner_texts()
        assert buttons == [words["markup"][name] for name in names]
        assert page.locator("#view").get_attribute("aria-label").endswith("mit den Pfeiltasten.")
        page.get_by_role("button", name=words["markup"]["help"]).click()
        page.locator("#help").get_by_text(words["panels"]["howTo"]).wait_for()
        assert page.locator("#help").get_by_text(words["panels"]["dragWalk"]).is_visible()
    assert sum("/words-" in one.path for one in visitor.visits) == 1


def test_an_error_is_in_the_language_of_the_browser(
    visit: Callable[..., Any], museum: Site
) -> None:
    def refuse(page: Any) -> None:
        page.route("**/index-*.json", lambda route: route.fulfill(status=404))

    with visit(museum, prepare=refuse, locale="ja-JP") as visitor:
        error, words = visitor.page.locator("#error"), words_of("ja")
        error.get_by_text("PTM-V103").wait_for()
        text = error.inner_text()
    assert words["page"]["PTM-V103"] in text
    assert words["markup"]["noWalk"] in text
    assert words["page"]["missing"].removeprefix("{file} ") in text
    assert words["markup"]["reload"] in text
