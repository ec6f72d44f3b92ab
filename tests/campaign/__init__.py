"""Hundreds of millions of impacts of PIC, each one checked: ``python -m tests.campaign``."""
