"""Campaigns that check PIC on many random gases and scenes: ``python -m tests.campaign``."""
