"""How commands start: Ctrl-C is tested with each of them, the rest here."""

import gc

from agents.commands.starting import loading


def test_loading__looks_for_no_garbage_and_does_so_afterwards() -> None:
    assert gc.isenabled()
    with loading():
        assert not gc.isenabled()
    assert gc.isenabled()
    gc.unfreeze()
