"""Designs solved by the workers of a Dask cluster: the same result, and clear words where it can't
be used."""

from __future__ import annotations

import distributed
import numpy as np
import pytest
from support.dask_clusters import hurried, local_cluster

from kop_exudyn.errors import InputError
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.report.verdicts import kit_verdicts
from kop_exudyn.search import cluster as clusters
from kop_exudyn.search.cluster import Cluster
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings

pytestmark = pytest.mark.filterwarnings("ignore")  # of the cluster's own libraries

PARTS = {"linear": 4, "angular": 2}
STAGES = StageSettings(
    schedule=(1e4,),
    relaxed_steps=1,
    assigned_steps=1,
    round_steps=1,
    reassignments=1,
    leaps=0,
    path_steps=1,
    restarts=2,
    effort="quick",
    levelling=0,
    requirements=Requirements(samples=1),
)


def test_the_same_kit_as_alone(repository):
    designs = load_designs(repository / "models" / "small")[:2]

    def found(**where):
        settings = JobSettings(stages=STAGES, baselines=False, **where)
        return optimize_kit(designs, PARTS, settings=settings)

    alone = found(jobs=1)
    with local_cluster(2) as cluster:
        there = found(scheduler=cluster.scheduler_address)
        verdicts = kit_verdicts(there, scheduler=cluster.scheduler_address)
    np.testing.assert_array_equal(there.kit.vector, alone.kit.vector)
    assert there.stages["assigned"].value == alone.stages["assigned"].value
    assert there.equilibria == alone.equilibria > 10
    described = [one.settings for one in (there, alone)]
    assert not any("scheduler" in one for one in described)
    assert [one.to_dict() for one in verdicts] == [one.to_dict() for one in kit_verdicts(alone)]
    assert there.peak_memory_mb > 1.5 * alone.peak_memory_mb  # its workers count


def test_clusters_that_cannot_be_used_are_refused(monkeypatch):
    with local_cluster(1, threads=2) as cluster:
        many = pytest.raises(InputError, match="1 of 1 .*more than one thread.*--nthreads 1")
        with many:
            Cluster(cluster.scheduler_address, int, ())
    with local_cluster(1) as cluster:
        monkeypatch.setattr(clusters, "code_digest", _another_version)
        other = pytest.raises(InputError, match="1 of 1 workers .* run another version")
        with other:
            Cluster(cluster.scheduler_address, int, ())
    with local_cluster(0) as cluster, pytest.raises(InputError, match="has no workers: start some"):
        Cluster(cluster.scheduler_address, int, ())
    monkeypatch.setattr(distributed, "Client", hurried(distributed.Client))
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        Cluster("tcp://127.0.0.1:9", int, ())


def _another_version():
    from kop_exudyn.provenance import code_digest
    from kop_exudyn.search import cluster

    # here it is replaced, in the workers it isn't
    return code_digest() if cluster.code_digest is code_digest else "another"
