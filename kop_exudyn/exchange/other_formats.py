"""Files of other programs that can't be read: told by their names, or by their first bytes under a
wrong name, and what to save instead."""

from __future__ import annotations

_DRAWING = "save the net as DXF"
_MESH = "save the surface as OBJ, PLY or STL"
# ending -> what it is, what to do
_FORMATS = {
    "dwg": ("a drawing of AutoCAD", _DRAWING),
    "dgn": ("a drawing of MicroStation", _DRAWING),
    "svg": ("a picture of lines", f"{_DRAWING}, in Inkscape or Illustrator, say"),
    "ai": ("a picture of Illustrator", _DRAWING),
    "eps": ("a page", _DRAWING),
    "pdf": ("a page", f"{_DRAWING} where it was drawn, or in Inkscape, say"),
    "skp": ("a model of SketchUp", f"{_DRAWING} there, or {_MESH}"),
    "gh": ("a definition of Grasshopper", "bake its curves and save them in Rhino, as 3dm or DXF"),
    "ghx": ("a definition of Grasshopper", "bake its curves and save them in Rhino, as 3dm or DXF"),
    "step": ("a solid model", f"{_DRAWING}, its laths' axes, or {_MESH}"),
    "stp": ("a solid model", f"{_DRAWING}, its laths' axes, or {_MESH}"),
    "iges": ("a solid model", f"{_DRAWING}, its laths' axes, or {_MESH}"),
    "igs": ("a solid model", f"{_DRAWING}, its laths' axes, or {_MESH}"),
    "sat": ("a solid model", f"{_DRAWING}, its laths' axes, or {_MESH}"),
    "fcstd": ("a model of FreeCAD", f"{_DRAWING} there, or {_MESH}"),
    "blend": ("a model of Blender", f"{_DRAWING} there, or {_MESH}"),
    "rvt": ("a model of Revit", f"{_DRAWING} there, or {_MESH}"),
    "ifc": ("a building model", f"{_DRAWING}, its laths' axes, or {_MESH}"),
    "glb": ("a model for pictures", _MESH),
    "gltf": ("a model for pictures", _MESH),
    "fbx": ("a model for pictures", _MESH),
    "dae": ("a model for pictures", _MESH),
    "3ds": ("a model for pictures", _MESH),
    "3mf": ("a model for printers", _MESH),
    "vtk": ("a mesh", _MESH),
    "png": ("a picture of pixels", "draw the net over it in CAD"),
    "jpg": ("a picture of pixels", "draw the net over it in CAD"),
    "jpeg": ("a picture of pixels", "draw the net over it in CAD"),
    "zip": ("an archive", "unpack it"),
    "geojson": ("a map", f"{_DRAWING}, in QGIS, say"),
    "kml": ("a map", f"{_DRAWING}, in QGIS, say"),
    "shp": ("a map", f"{_DRAWING}, in QGIS, say"),
    "csv": ("a table", _DRAWING),
    "xlsx": ("a table", _DRAWING),
}
# what files of these formats begin with
_STARTS = {
    b"AC10": "dwg",
    b"%PDF": "pdf",
    b"glTF": "glb",
    b"ISO-10303-21": "step",
    b"\x89PNG": "png",
    b"\xff\xd8\xff": "jpg",
    b"BLENDER": "blend",
    b"%!PS": "eps",
}
_LOOKED_AT = 400  # bytes at a file's beginning


def instead_of(name: str) -> str:
    """What to save instead of a file of that name, to go on in a sentence; "" where that isn't
    known."""
    found = _FORMATS.get(name.lower().rpartition(".")[2])
    return "" if found is None else f": it is {found[0]}; {found[1]}"


def is_really(content: bytes) -> str | None:
    """What a file is by its first bytes, and what to do, in words; None where they tell nothing."""
    head = content[:_LOOKED_AT].lstrip()
    name = next((name for start, name in _STARTS.items() if head.startswith(start)), None)
    if name is None and head.startswith(b"<") and b"<svg" in head:
        name = "svg"
    if name is None:
        return None
    what, how = _FORMATS[name]
    return f"is {what} by its content ({name.upper()}), whatever its name: {how}"
