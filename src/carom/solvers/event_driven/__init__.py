"""Event-driven PIC: runs for any number of discs, which compute from impact to impact."""
