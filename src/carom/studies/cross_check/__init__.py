"""Study: runs scenes on engines, and scores each run against PIC. The study makes the report of `carom run`."""
