"""The committed sample report is a page that works."""

import base64
import hashlib
import re
from html import unescape
from pathlib import Path

PAGE = Path(__file__).parents[2] / "reports/sample/index.html"


def test_content_policy_allows_the_script_of_the_sample() -> None:
    """The hash in the page's content policy is that of its script, or a browser would not run the script."""
    text = PAGE.read_text(encoding="utf-8")
    allowed = re.findall(r"'sha256-([^']+)'", unescape(text))
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts] == allowed
