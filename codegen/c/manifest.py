"""What a generated folder says of itself, for loaders."""

import hashlib
import json
from dataclasses import asdict
from typing import Any

from signorini.codegen.c.layout import Field
from signorini.codegen.c.spec import EmitSpec


def manifest_hash(spec: EmitSpec) -> str:
    """Hash of the manifest; the C code carries it, so that a loader sees any edit."""
    return hashlib.sha256(json.dumps(_manifest(spec), sort_keys=True).encode()).hexdigest()


def manifest(spec: EmitSpec) -> dict[str, Any]:
    """What a loader needs: names, sizes, struct layouts, function signatures, its own hash."""
    return _manifest(spec) | {"manifest_hash": spec.manifest_hash}


def _manifest(spec: EmitSpec) -> dict[str, Any]:
    return {
        "generator": f"signorini {spec.version}",
        "model": spec.model,
        "doc": spec.doc,
        "prefix": spec.prefix,
        "scheme": spec.scheme,
        "stages": spec.stages,
        "velocity_constraints": spec.velocity_constraints,
        "events": spec.events,
        "derivatives": spec.forward is not None,
        "max_couplings": spec.max_couplings,
        "adaptive": spec.adaptive,
        "influence": asdict(spec.forward.influence) if spec.forward else None,
        "precision": spec.precision.name,
        "explicit_time": spec.explicit_time,
        "stable_phase": spec.stable_phase,
        "stable_scratch": spec.stable_scratch,
        "sizes": asdict(spec.sizes),
        "coordinates": list(spec.coordinates),
        "velocities": list(spec.velocities),
        "units": list(spec.units),
        "inputs": list(spec.inputs),
        "parameters": [asdict(p) for p in spec.parameters],
        "g_blocks": [list(b) for b in spec.g_blocks],
        "gamma_blocks": [list(b) for b in spec.gamma_blocks],
        "contacts": [asdict(c) for c in spec.contacts],
        "compliant": list(spec.compliant),
        "outputs": list(spec.outputs),
        "shapes": [{"kind": k, "name": name, "points": n} for k, name, n in spec.shapes],
        "statuses": [list(s) for s in spec.statuses],
        "contact_states": list(spec.contact_states),
        "event_kinds": list(spec.event_kinds),
        "structs": {s.name: [_field(f) for f in s.fields] for s in spec.structs},
        "functions": {
            f.name: {"arguments": list(f.arguments), "shape": list(f.shape)} for f in spec.functions
        },
        "zeros": {name: list(shape) for name, shape in spec.zeros},
        "kinds": [
            {
                "name": kind.name,
                "sizes": asdict(kind.sizes),
                "problems": [
                    {
                        "name": p.name,
                        "n_x": p.n_x,
                        "n_slots": p.n_slots,
                        "x": p.x,
                        "R": p.R,
                        "tables": {name: list(values) for name, values in p.tables},
                    }
                    for p in kind.problems
                ],
            }
            for kind in spec.kinds
        ],
        "parts": [asdict(part) for part in spec.parts],
        "footprint": asdict(spec.footprint),
        "runtime_hash": spec.runtime_hash,
        "model_hash": spec.model_hash,
        "tools": dict(spec.tools),
    }


def _field(f: Field) -> dict[str, Any]:
    return {"name": f.name, "type": f.type, "extent": f.extent if f.dims else 0}
