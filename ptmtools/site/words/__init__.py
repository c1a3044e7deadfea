"""The words of the page, of the pages of other forms and of the catalogue, by language.

One file for each language, section → name → text. All have the names of ``en.json``, and the same
``{fields}`` in each text. ``web/page/build.py`` makes the scripts of the page from them. The
translations are unreviewed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).parent
#: Languages that have words; English for all others.
LANGUAGES = ("en", "de", "fr", "es", "it", "zh", "ja")


def has_words(language: str) -> bool:
    """Whether a language tag such as ``de-AT`` has words of its own."""
    return language.split("-")[0].lower() in LANGUAGES


@cache
def words_of(language: str) -> Mapping[str, Any]:
    """The words for a language tag such as ``de-AT``: section → name → text, and ``direction``,
    ``ltr`` or ``rtl``; in English where the language has none."""
    name = language.split("-")[0].lower() if has_words(language) else "en"
    words: Mapping[str, Any] = json.loads((_FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return words
