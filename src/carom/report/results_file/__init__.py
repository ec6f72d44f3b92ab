"""The file results.jsonl: types of its lines, their JSON, and its writer and reader."""
