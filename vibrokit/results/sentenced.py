"""Sentenced: what codes with a sentence each have in common."""

from __future__ import annotations

from enum import StrEnum
from typing import Self


class Sentenced(StrEnum):
    """Codes, each with a sentence, which may be a template of the values that go with it."""

    sentence: str

    def __new__(cls, value: str, sentence: str) -> Self:
        member = str.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member
