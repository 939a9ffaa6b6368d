"""What lies in the desk's folder: every file, and what the columns of the tables mean."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..files.read_me import read_me_text
from ..units import Units

# Patterns of file names; the first that fits counts.
_FILES = {
    r"designs\.csv": "one line a design and stage: its units, how far it is off its target, its "
    "states' energies and stresses",
    r"elements\.csv": "one line an element: the part that it is made of, and its parameters in "
    "every stage",
    r"loads\.csv": "one line a design and load case: what it does under it",
    r"joints\.csv": "one line a joint and stage: its place, and its distance from the target",
    r"parts\.csv": "one line a part of the kit",
    r"steps\.csv": "one line an accepted step of the search",
    r".*rods\.csv": "one line a rod element and state: strains, forces, moments and stresses",
    r".*_target\.obj": "the target surface, in the designs' unit",
    r".*\.3dm": "all states of the design for Rhino: centre lines and solids, on layers by part",
    r".*\.compas\.json": "graph and mesh of the state for COMPAS 2: json_load gives both",
    r".*\.glb": "solids coloured by part, with the target, in metres and y up as glTF asks: for "
    "Blender, Rhino, web pages. Designs far from the origin are moved to it, all states of one "
    "alike: the node origin says from where (origin_metres)",
    r".*\.obj": "centre lines of the state, one named group an element (part and number)",
    r".*\.ply": "solids of the state, coloured by part, in the designs' unit",
    r".*\.vtu": "centre lines with strains, forces, moments, stresses and deviations as fields, "
    "for ParaView; the field part is the number in parts.csv",
}
_STAGE = r"(input|direct|unrelaxed|relaxed|assigned|published)"
# Columns of the tables; the first that fits counts.
_COLUMNS = {
    r"design": "name of the design",
    r"class": "its class",
    r"stage": "input: as given; direct: nearest parts; unrelaxed: parts tuned from there; relaxed: "
    "elements near parts; assigned: made of parts, the result; redeployed: where that opens into "
    "by itself. Of steps: the stage of the search",
    r"(length|force)_unit": "in which the lengths, and forces, of all tables are; empty where the "
    "designs name none. Angles are in radians",
    r"elements": "how many the design has",
    r"failed": "why no state was found",
    r"(max|mean)_percent": "largest, and mean, distance of the joints from the target, % of its "
    "size",
    r"pieces_(max|mean)_percent": "the same of all points of the rods, between joints too",
    r"(pieces_)?(max|mean)": "the same as lengths",
    r"\w+_energy": "elastic energy of that state",
    r"\w+_energy_ratio": "over that of the input design, deployed",
    r"\w+_stable": "whether the state is a minimum of the energy",
    r"\w+_opening": "mean angle between the rods that cross, which is prescribed",
    r"\w+_torque": "the moment that holds it",
    r"\w+_equivalent_stress": "the largest of all rods (von Mises)",
    r"\w+_utilisation": "that over the material's elastic limit: above 1 it yields or breaks",
    r"element": "number of the element in its design; 0: of none",
    r"kind": "linear: a straight piece; angular: a corner; cell: two plates and their arms; slit: "
    "a straight piece with slits",
    r"part": "label of the part",
    r"variant": "as is, or how else the part is built in",
    _STAGE + r"_[0-9]+": "parameters of the element in that stage, in the order of the part's",
    r"joint": "number of the joint",
    r"[xyz]": "its place, in the coordinates of the design's file",
    r"distance": "from the target",
    r"distance_percent": "the same, % of the target's size",
    r"state": "deployed, rest (as assembled) or loaded",
    r"rod_element": "number of the rod element",
    r"rod": "number of the rod",
    r"rest_length": "of the element without stress",
    r"stretch|shear_[yz]": "strain along the rod, and across it",
    r"twist|curvature_[yz]": "per length, about the section's axes; against the rod's own shape",
    r"N|Q[yz]": "normal and shear forces",
    r"Mt|M[yz]": "torque and bending moments",
    r"axial_stress": "of the normal force alone",
    r"(normal|shear)_stress": "the largest in the section",
    r"equivalent_stress": "the largest in the section (von Mises)",
    r"utilisation": "that over the material's elastic limit: above 1 it yields or breaks",
    r"deviation": "distance of the rod from the target",
    r"number": "of the part, as the field part in VTU files has it",
    r"angle|l1|l2|top|bottom|slit": "the part's parameters; empty for other kinds",
    r"sqp": "which optimisation of the stage",
    r"weight": "of the distance to parts in the objective",
    r"step": "number of the step",
    r"value": "of the objective after it",
    r"term_.*": "the objective's terms",
    r"load_case": "name of the load case",
    r"factor": "that stress and stability are asked for: the loads times it",
    r"deflection|deflection_limit": "the largest under the loads themselves, and what is allowed",
    r"span": "largest distance between two supports",
    r"critical_factor": "up to which the loads may grow until the design gives way",
    r"critical_factor_is_larger": "whether it is only known to be at least that",
    r"stable": "whether it bears the loads times the factor",
    r"force_[xyz]": "sum of all loads",
    r"largest_reaction": "force of the support with the most",
    r"seconds_.*": "wall time of that part of the step",
    r"gradient_norm|predicted|actual|damping|radius|length|trials|failures|active|convexified|"
    r"solver|excess|penalty": "figures of the optimiser, see StepRecord in the documentation",
}


def desk_read_me(title: str, units: Units | None, files: Sequence[Path]) -> str:
    """The text of READ_ME.txt.

    title : its first line
    units : of the designs
    files : all that lie in the folder
    """
    lengths = (
        "The designs name no unit of length: files are in what their drawings were in"
        if units is None
        else f"Lengths are in {units.length}, forces in {units.force}"
    )
    sentences = [
        f"{lengths}; .glb files are in metres. Designs stand where they fit their targets best, in "
        "the coordinates of their files."
    ]
    return read_me_text(title, sentences, files, _FILES, _COLUMNS)
