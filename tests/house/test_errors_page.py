"""Messages that docs/errors.md explains are messages that the programs give."""

from pathlib import Path
import re

ROOT = Path(__file__).resolve().parents[2]
OF_PYTHON = ("no module named 'rclpy'",)


def quoted():
    """Return the messages of the page's first columns, in code."""
    rows = re.findall(r'(?m)^\| (.+?) \| ', (ROOT / 'docs' / 'errors.md').read_text())
    return [said for row in rows for said in re.findall(r'`([^`]+)`', row)]


def sources():
    """Return all that the programs say, literals that stand side by side joined."""
    text = ''.join(path.read_text() for path in [*ROOT.glob('src/*/*/**/*.py'), ROOT / 'env.sh'])
    return re.sub(r"""['"]\s*\n\s*f?['"]""", '', text)


def test_each_message_is_one_of_ours():
    known = sources()
    unknown = []
    for said in set(quoted()) - set(OF_PYTHON):
        parts = re.split(r"'?\b[A-Z]{1,}\b'?|\[[^\]]*\]", said)
        if not all(part.strip(" '[],?") in known for part in parts):
            unknown.append(said)
    assert len(quoted()) > 25 and not unknown
