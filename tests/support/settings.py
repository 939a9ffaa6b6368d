"""Settings of searches whose results only have to be there."""

from dataclasses import replace

from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings

# What errors do takes more simulations than all steps of such searches: a few sets of them tell.
FEW_ERRORS = Requirements(samples=2)
# The rest of a search that costs little: one start, and no last tuning of the largest deviation.
QUICK = StageSettings(effort="quick", levelling=0, requirements=FEW_ERRORS)
# A short search that moves the parts to where the objective's terms tell.
FEW_STEPS = replace(
    QUICK,
    schedule=(1e4,),
    relaxed_steps=6,
    assigned_steps=10,
    reassignments=0,
    redeployments=0,
)
# One accepted step a stage: files and pages don't need more.
ONE_STEP = replace(
    QUICK,
    schedule=(1e4,),
    relaxed_steps=1,
    assigned_steps=1,
    reassignments=0,
    path_steps=2,
)
