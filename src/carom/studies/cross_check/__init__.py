"""Study: runs scenes on engines, and scores each run against PIC. It makes the report of `carom run`."""
