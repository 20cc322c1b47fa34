"""The backdoor of a process, with its token in a file, from another address, in Python and by curl."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.client import Iiwa
from iiwa_sim.controller.errors import Refused
from iiwa_sim.protocols.faults import Drop
from tests.processes import running
from tests.talking import DEADLINE_S

TOKEN = "swordfish"
OTHER_ADDRESS = "127.0.0.2"  # all of 127/8 is this machine


def test_as_a_process_with_the_token_in_a_file(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n")
    options = ("--backdoor-host", "0.0.0.0", "--backdoor-token-file", str(file))
    with running("--backdoor-port", "0", "--log-level", "info", *options) as simulator:
        said, _, port = simulator.line().rpartition(":")
        assert said == "backdoor on 0.0.0.0"
        with pytest.raises(Refused, match="expected the header 'Authorization: Bearer TOKEN'"):
            BackdoorClient(OTHER_ADDRESS, int(port), "swordfisch").emergency_stop()
        bench = BackdoorClient(OTHER_ADDRESS, int(port), TOKEN)
        with Iiwa("127.0.0.1", simulator.port) as robot:
            bench.set_fault(Drop(), replies=1)
            with pytest.raises(TimeoutError), Iiwa("127.0.0.1", simulator.port, timeout_s=0.2) as other:
                other.get_mode()
            bench.emergency_stop()
            assert robot.get_error().code == 3030
            assert bench.state()["error"]["code"] == 3030
        curl = ["curl", "-s", "-m", str(DEADLINE_S), "-H", f"Authorization: Bearer {TOKEN}"]
        url = f"http://{OTHER_ADDRESS}:{int(port)}"
        told = subprocess.run([*curl, f"{url}/get_clock"], capture_output=True, check=True).stdout
        assert json.loads(told) == "real"
        refused = subprocess.run([*curl, "-d", '{"code": 0}', f"{url}/fail"], capture_output=True, check=True)
        assert json.loads(refused.stdout)["error"]["code"] == 3000
        code, log = simulator.ends(15)
    assert code == 0
    assert "expected the header 'Authorization: Bearer TOKEN'" in log
    assert "swordfi" not in log
