"""Settings of searches whose results only have to be there."""

from kop_exudyn.search.settings import StageSettings

# One accepted step a stage: files and pages don't need more.
ONE_STEP = StageSettings(
    schedule=(1e4,),
    relaxed_steps=1,
    assigned_steps=1,
    reassignments=0,
    path_steps=2,
    effort="quick",
    levelling=0,
)
