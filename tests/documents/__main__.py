"""`python -m tests.documents FILE...`: write the generated parts of these documents anew."""

import sys
from pathlib import Path

from tests.documents.parts import filled

for path in map(Path, sys.argv[1:]):
    path.write_text(filled(path.read_text()))
