"""Campaigns that check many random runs of PIC."""
