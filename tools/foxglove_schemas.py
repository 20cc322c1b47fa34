"""Writes `tests/recordings/foxglove_schemas.json` anew, by `python -m tools.foxglove_schemas`.

That are the JSON schemas that Foxglove publishes, of what recordings hold, from npm's @foxglove/schemas (MIT
licence, by Foxglove: github.com/foxglove/foxglove-sdk), without texts. What is kept says which properties
there are, of which types, within which limits, and which are required.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

PACKAGE = "@foxglove/schemas@2.1.0"
FILE = Path(__file__).parents[1] / "tests" / "recordings" / "foxglove_schemas.json"
WANTED = ("FrameTransforms", "JointStates", "Log", "SceneUpdate")
TEXTS = ("description", "$comment")
PRINT = """
const schemas = require("@foxglove/schemas/jsonschema");
process.stdout.write(JSON.stringify(schemas));
"""


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        install = ["npm", "install", "--prefix", folder, "--no-audit", "--no-fund", PACKAGE, "tslib"]
        subprocess.run(install, check=True, stdout=sys.stderr)
        printed = subprocess.run(["node", "-e", PRINT], cwd=folder, check=True, stdout=subprocess.PIPE)
    schemas = json.loads(printed.stdout)
    kept = {schemas[name]["title"]: without_texts(schemas[name]) for name in WANTED}
    FILE.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def without_texts(schema: Any) -> Any:
    if isinstance(schema, dict):
        return {
            key: each if key == "required" else without_texts(each)
            for key, each in schema.items()
            if not (key in TEXTS and isinstance(each, str))
        }
    return [without_texts(each) for each in schema] if isinstance(schema, list) else schema


if __name__ == "__main__":
    main()
