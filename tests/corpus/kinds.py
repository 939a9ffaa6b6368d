"""All of the corpus: importing this module fills `drawings.CASES` and `meshes.CASES`."""

import dxf_blocks  # noqa: F401
import dxf_curves  # noqa: F401
import dxf_files  # noqa: F401
import dxf_layers  # noqa: F401
import dxf_pieces  # noqa: F401
import dxf_planes  # noqa: F401
import insertions  # noqa: F401
import mesh_styles  # noqa: F401
import misdrawn  # noqa: F401
import obj_files  # noqa: F401
import obj_styles  # noqa: F401
import rhino_files  # noqa: F401
import sheets  # noqa: F401
import splines  # noqa: F401
from drawings import CASES, Net, Refused

__all__ = ["CASES", "Net", "Refused"]
