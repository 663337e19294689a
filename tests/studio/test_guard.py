"""Who may speak to the studio."""

import pytest

from printhammer.studio.guard import Guard

HOST = {"host": "127.0.0.1:8000"}
OWN = {**HOST, "origin": "http://127.0.0.1:8000"}


@pytest.mark.parametrize(
    ("headers", "token", "origin", "reason"),
    [
        (OWN, "secret", True, ""),
        ({"host": "localhost:8000", "origin": "http://localhost:8000"}, "secret", True, ""),
        (HOST, None, False, ""),
        ({}, None, False, "the host"),
        ({"host": "evil.example:8000"}, "secret", False, "the host"),
        ({"host": "127.0.0.1:9000"}, "secret", False, "the host"),
        ({"host": "127.0.0.1"}, "secret", False, "the host"),
        (HOST, "secret", True, "a page of the studio"),
        ({**HOST, "origin": "null"}, "secret", True, "a page of the studio"),
        ({**HOST, "origin": "http://evil.example"}, "secret", True, "a page of the studio"),
        ({**HOST, "origin": "https://127.0.0.1:8000"}, "secret", True, "a page of the studio"),
        (OWN, "", True, "the token"),
        (OWN, "Secret", True, "the token"),
        (OWN, "sécret", True, "the token"),
    ],
)
def test_only_pages_of_its_own_with_the_token(
    headers: dict[str, str], token: str | None, origin: bool, reason: str
) -> None:
    told = Guard(8000, "secret").refuse(headers, token, origin)
    assert bool(told) == bool(reason)
    assert reason in told


def test_every_studio_has_a_token_of_its_own() -> None:
    first, second = Guard(8000), Guard(8000)
    assert first.token != second.token
    assert len(first.token) >= 24
    assert first.address == f"http://127.0.0.1:8000/?token={first.token}"
