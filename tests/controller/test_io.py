"""Digital inputs and outputs, of any number."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.io import NOT_AN_OUTPUT, NUMBER_OUT_OF_RANGE, Io

counts = st.integers(0, 40)


@pytest.mark.requirement("FRC022", "FRC023", "FRC024")
@given(counts, counts, st.lists(st.tuples(st.booleans(), st.integers(-2, 42), st.booleans())))
def test_inputs_and_outputs_keep_their_last_state_and_wrong_numbers_change_nothing(
    inputs: int, outputs: int, switched: list[tuple[bool, int, bool]]
) -> None:
    io = Io(tuple(f"i{k}" for k in range(inputs)), tuple(f"o{k}" for k in range(outputs)))
    expected = {True: [False] * inputs, False: [False] * outputs}
    for is_input, number, on in switched:
        states = expected[is_input]
        switch, read = (io.wire, io.input) if is_input else (io.set_output, io.output)
        if 1 <= number <= len(states):
            switch(number, on)
            states[number - 1] = on
            assert read(number) == on
        else:
            with pytest.raises(Refused) as refused:
                switch(number, on)
            assert refused.value.code == NUMBER_OUT_OF_RANGE
            with pytest.raises(Refused, match=f"{number}: there are"):
                read(number)
        assert io.inputs == tuple(expected[True])
        assert io.outputs == tuple(expected[False])


def test_there_are_16_inputs_and_outputs_by_default() -> None:
    assert len(Io().inputs) == len(Io().outputs) == 16
    io = Io(("door",), ())
    assert io.inputs == (False,)
    with pytest.raises(Refused, match=r"^1 no output 1: there are no outputs$"):
        io.output(1)
    with pytest.raises(Refused, match="'door'") as refused:
        io.refuse_input(1)
    assert refused.value.code == NOT_AN_OUTPUT
    with pytest.raises(Refused) as refused:
        Io().output(int(1e308))
    assert refused.value.reason == "no output 1e+308: there are outputs 1 to 16"
