"""The file results.jsonl: types of its lines, their conversion to JSON, and functions that write and read the file."""
