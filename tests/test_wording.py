"""One curve, two curves."""

from kop_exudyn.wording import beside_units, counted, counted_parts


def test_one_and_several():
    assert [counted(n, "curve") for n in (0, 1, 2)] == ["0 curves", "1 curve", "2 curves"]
    assert counted(1, "vertex", "vertices") == "1 vertex"
    assert counted(1200, "vertex", "vertices") == "1,200 vertices"


def test_sizes_of_kits():
    assert counted_parts({"linear": 12, "angular": 5}) == "12 linear and 5 angular parts"
    assert counted_parts({"linear": 1, "angular": 1}) == "1 linear and 1 angular parts"
    assert counted_parts({"cell": 1}) == "1 cell part"


def test_numbers_stay_beside_their_units():
    assert beside_units("max 36 % of 4.5 mm, 3 parts") == "max 36\xa0% of 4.5\xa0mm, 3 parts"
