"""Tables that an option names: what has no end is not waited for."""

import os

import pytest
from refusals import refused

from gensig.driveline.shaft_tables import read_gears, read_shafting
from gensig.text import user_file
from gensig.text.user_file import read_table


def table(key, file):
    return read_table(key, file, least_rows=1)


@pytest.mark.parametrize("read", [table, read_shafting, read_gears])
def test_devices_and_pipes_are_refused(read, tmp_path):
    pipe = tmp_path / "t.csv"
    os.mkfifo(pipe)
    for file in ("/dev/zero", str(pipe)):
        with refused(f"key = {file} cannot be read: it is no file"):
            read("key", file)
    with refused("Is a directory"):
        read("key", str(tmp_path))


@pytest.mark.parametrize("read", [table, read_shafting])
def test_a_table_that_is_too_large_is_refused(read, tmp_path, monkeypatch):
    file = tmp_path / "t.csv"
    file.write_text("a,b\n1,2\n")
    assert table("key", str(file))[0] == ["a", "b"]
    monkeypatch.setattr(user_file, "MOST_BYTES", 7)
    with refused("is larger than 0 MB; cut it"):
        read("key", str(file))
