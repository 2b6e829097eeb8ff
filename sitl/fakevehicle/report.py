"""What a test wants to know afterwards: the event log and the JSON dump of everything held."""

import json
import os
import tempfile
from collections import Counter, deque

from .ardupilot_storage import home_item
from .dialect import MISSION, TYPE_NAMES

LAST_EVENTS = 400
LAST_UPLOADS = 200
UPLOADS_WITH_ITEMS = 20


class EventLog:
    """Counts all events and keeps the last ones. Listeners (scripts, faults) are told at once."""

    def __init__(self, clock):
        self.clock = clock
        self.reset()

    def reset(self):
        """Forgets everything, listeners too."""
        self.counts = Counter()
        self.last = deque(maxlen=LAST_EVENTS)
        self.uploads = deque(maxlen=LAST_UPLOADS)
        self.upload_counts = Counter()
        self.listeners = []

    def add(self, name, fields):
        self.counts[name] += 1
        self.last.append({"at_s": round(self.clock(), 4), "event": name, **fields})
        for listener in list(self.listeners):
            listener(name, fields)

    def add_upload(self, upload, result):
        self.upload_counts[f"{TYPE_NAMES[upload.mission_type]}:{result}"] += 1
        self.uploads.append((upload, result, self.clock()))

    def uploads_json(self):
        first_whole = len(self.uploads) - UPLOADS_WITH_ITEMS
        return [upload.to_json(result, at, with_items=index >= first_whole)
                for index, (upload, result, at) in enumerate(self.uploads)]


def dump(vehicle):
    """Everything the vehicle holds, as one JSON-ready dictionary."""
    document = {
        "persona": vehicle.persona.name, "sysid": vehicle.sysid, "seed": vehicle.faults.seed,
        "uptime_s": round(vehicle.clock(), 3), "boots": vehicle.boots, "down": vehicle.down,
        "vanished": vehicle.vanished, "armed": vehicle.armed, "mode": vehicle.mode,
        "custom_mode": vehicle.custom_mode, "current_seq": vehicle.current_seq,
        "home": _place(vehicle.home), "position": _place(vehicle.position),
        "capacities": {TYPE_NAMES[kind]: most for kind, most in vehicle.capacities.items()},
    }
    for mission_type, name in TYPE_NAMES.items():
        if mission_type not in vehicle.store.items:
            continue
        items = list(vehicle.store.items[mission_type])
        if mission_type == MISSION and items and vehicle.persona.home_is_item_zero:
            items[0] = home_item(vehicle.home)
        document[name] = {"count": len(items), "id": vehicle.store.id(mission_type),
                          "items": [item.to_json(seq) for seq, item in enumerate(items)]}
    document.update(
        uploads=vehicle.log.uploads_json(), upload_counts=dict(vehicle.log.upload_counts),
        parameters={name: value for name, (value, _) in vehicle.parameters.table.items()},
        faults=vehicle.faults.to_json(),
        links=[{"name": channel.name, "heard": sorted(list(peer) for peer in channel.heard), **channel.counts}
               for channel in vehicle.channels],
        events={"counts": dict(vehicle.log.counts), "last": list(vehicle.log.last)},
    )
    return document


def _place(place):
    return dict(zip(("lat", "lon", "alt"), place))


def write_json(path, document):
    """Writes the whole file or nothing: readers never see half of it."""
    directory = os.path.dirname(os.path.abspath(path))
    handle, temporary = tempfile.mkstemp(dir=directory, prefix=".fake-vehicle-", suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump(document, file, indent=1, allow_nan=False)
            file.write("\n")
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
