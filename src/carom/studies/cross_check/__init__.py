"""Study behind `carom run`: runs scenes on engines, and compares each run with PIC."""
