"""A base to build on where no registry of images is reached: Debian 12 by debootstrap, with its own Python.

It stands in for the official slim image of Python, and has its name: Python is found in /usr/local/bin, and
there are no .pyc of the standard library. Its Python is 3.11, the official one's 3.13.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

from engine import Engine, NoImagesHere

SUITE = "bookworm"
PACKAGES = ["ca-certificates", "python3", "python3-dev", "python3-venv"]


def make(engine: Engine, name: str) -> None:
    """Make it, and tag it with the name of the base it stands for. Raises `NoImagesHere`."""
    if shutil.which("debootstrap") is None:
        raise NoImagesHere(f"{name} cannot be pulled, and there is no debootstrap to make a base with")
    with tempfile.TemporaryDirectory(prefix="iiwa-sim-base-") as scratch:
        root = Path(scratch) / "root"
        words = ["debootstrap", "--variant=minbase", f"--include={','.join(PACKAGES)}", SUITE, str(root)]
        try:
            done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=900)
        except subprocess.TimeoutExpired:
            raise NoImagesHere("debootstrap makes no base here: nothing after 900 s") from None
        if done.returncode:  # for want of privileges, or of a mirror
            said = (done.stdout + done.stderr).strip().splitlines() or [f"exit code {done.returncode}"]
            raise NoImagesHere(f"debootstrap makes no base here: {said[-1]}")
        for program in ("python", "python3"):
            (root / "usr/local/bin" / program).symlink_to("/usr/bin/python3")
        for compiled in [*(root / "usr/lib").glob("python3*/**/__pycache__")]:
            shutil.rmtree(compiled, ignore_errors=True)
        for cached in [*(root / "var/cache/apt/archives").glob("*.deb")]:
            cached.unlink()
        archive = root.with_suffix(".tar")
        subprocess.run(["tar", "--directory", str(root), "--create", "--file", str(archive), "."], check=True)
        path = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
        engine("import", "--change", f"ENV PATH={path}", str(archive), name, timeout_s=300)


def settings(scratch: Path) -> list[str]:
    """Options of a build that lend it this machine's certificates and pip's settings and leave none inside.

    A machine that reaches no registry of images may well have mirrors of packages of its own.
    """
    certificates = Path("/etc/ssl/certs")
    options = ["--volume", f"{certificates}:{certificates}:ro"] if certificates.is_dir() else []
    listed = subprocess.run(
        ["python3", "-m", "pip", "config", "list"], capture_output=True, text=True, check=False
    )
    lines = (line.partition("=") for line in listed.stdout.splitlines())
    known = {key.rpartition(".")[2]: value.strip("'") for key, _, value in lines}
    lent = {
        key: known[key] for key in ("index-url", "cert", "trusted-host", "default-timeout") if key in known
    }
    config = scratch / "pip.conf"
    config.write_text("".join(["[global]\n", *(f"{key} = {value}\n" for key, value in lent.items())]))
    return [*options, "--volume", f"{config}:/etc/pip.conf:ro"]
