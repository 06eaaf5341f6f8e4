"""What is written to nodes: orders, identifiers and mappings of CiA 301 and 402."""

import pytest

from painter.canopen.config.bus_file import load_bus
from painter.canopen.config.device import DeviceDescription, Mode, ObjectInfo
from painter.canopen.config.standard_objects import standard_drive, standard_io
from painter.canopen.master.od_config import (
    ConfigPlan,
    drive_rpdo,
    plan_drive,
    plan_io,
    write_and_verify,
)
from painter.canopen.protocol.od_types import DataType
from painter.canopen.protocol.sdo import SdoClient
from painter.canopen.sim.sdo_server import SdoServer
from painter.canopen.sim.store import ObjectStore
from painter.errors import BusError, InputError
from painter.resources import models_path


@pytest.fixture(scope="module")
def bus():
    return load_bus(models_path("bus", "painter.bus.yaml"))


@pytest.fixture(scope="module")
def drive_plan(bus):
    drive = bus.drives["shoulder_pitch"]
    return plan_drive(bus, drive, standard_drive(), bus.drive_limits()[1])


def device(*objects):
    return DeviceDescription("a device", objects)


def info(index, sub=0, access="rw", low=None, high=None):
    return ObjectInfo(
        index, sub, "", DataType.UNSIGNED16, access, default=0, low=low, high=high
    )


def values(plan, *indices):
    """(index, sub, value) of a plan's entries of some indices, in their order."""
    return [(e.index, e.sub, e.value) for e in plan.entries if e.index in indices]


def test_a_pdo_is_off_while_it_is_mapped(drive_plan):
    # CiA 301 7.5.2.36: destroy, set count 0, map, set count, create. Identifiers of
    # the pre-defined connection set: 200h + node-ID; here node 2.
    found = values(drive_plan, 0x1400, 0x1600)
    assert found[0] == (0x1400, 1, 0x80000202)
    pdo = [entry for entry in found[1:] if entry[:2] != (0x1400, 5)]
    assert pdo == [
        (0x1400, 2, 1),  # Synchronous, every SYNC.
        (0x1600, 0, 0),
        (0x1600, 1, 0x60400010),  # Controlword, 16 bits.
        (0x1600, 2, 0x607A0020),  # Target position, 32 bits.
        (0x1600, 0, 2),
        (0x1400, 1, 0x00000202),
    ]


def test_drives_send_status_and_position_each_sync(drive_plan):
    assert values(drive_plan, 0x1A00)[1:3] == [
        (0x1A00, 1, 0x60410010),
        (0x1A00, 2, 0x60640020),
    ]
    assert values(drive_plan, 0x1800)[-1] == (0x1800, 1, 0x182)
    assert values(drive_plan, 0x1801)[-1] == (0x1801, 1, 0x282)


def test_the_target_depends_on_the_mode():
    assert drive_rpdo(Mode.CYCLIC_SYNC_POSITION)[1] == (0x607A, 0, 32)
    assert drive_rpdo(Mode.INTERPOLATED_POSITION)[1] == (0x60C1, 1, 32)


def test_the_cycle_is_the_interpolation_period(bus, drive_plan):
    # 60C2h: 5 x 10^-3 s.
    assert bus.cycle == 0.005
    assert values(drive_plan, 0x60C2) == [(0x60C2, 1, 5), (0x60C2, 2, -3)]


def test_nodes_monitor_the_master_and_send_three_heartbeats_in_its_time(bus):
    plan = plan_io(bus, standard_io())
    # 1016h:1: node-ID in bits 16 to 23, time in ms below.
    assert values(plan, 0x1016) == [(0x1016, 1, 127 << 16 | 300)]
    assert values(plan, 0x1017) == [(0x1017, 0, 100)]


def test_outputs_of_the_io_node_close_when_the_master_is_lost(bus):
    # CiA 401: 6206h error mode, 6207h error value; 6443h and 6444h analogue.
    plan = plan_io(bus, standard_io())
    assert values(plan, 0x6206, 0x6207, 0x6443, 0x6444) == [
        (0x6206, 1, 0xFF), (0x6207, 1, 0), (0x6443, 1, 1), (0x6444, 1, 0),
    ]  # fmt: skip
    # The deadline of its RPDO, in ms.
    assert (0x1400, 5, round(1e3 * bus.io.deadline)) in values(plan, 0x1400)


def test_a_required_object_that_is_missing_or_read_only_is_named():
    plan = ConfigPlan(device(info(0x6065, access="ro")))
    for index in (0x6065, 0x6066):
        with pytest.raises(InputError, match=rf"a device: no writable {index:04X}h:0"):
            plan.require(index, 0, 1, "window")


@pytest.mark.parametrize(
    ("low", "high", "value", "bounds"),
    [
        (None, None, 1 << 16, "0 to 65535"),
        (1, 50, 51, "1 to 50"),
        (1, 50, 0, "1 to 50"),
    ],
)
def test_a_value_beyond_type_or_device_is_named(low, high, value, bounds):
    plan = ConfigPlan(device(info(0x6065, low=low, high=high)))
    with pytest.raises(InputError, match=rf"window \(6065h:0\) must be {bounds}, got"):
        plan.require(0x6065, 0, value, "window")


def test_a_requested_object_that_is_missing_or_fixed_is_a_note():
    plan = ConfigPlan(device(info(0x6066, low=0, high=0), info(0x6065)))
    plan.request(0x6085, 0, 1, "ramp", "its own.")
    plan.request(0x6066, 0, 10, "time", "none.")
    plan.request(0x6065, 0, 10, "window", "none.")
    assert plan.notes == ["no 6085h (ramp): its own.", "6066h (time) is fixed to 0."]
    assert values(plan, 0x6065, 0x6066, 0x6085) == [(0x6065, 0, 10)]


def test_pdos_that_are_not_used_are_switched_off():
    plan = ConfigPlan(standard_drive())
    plan.pdos_off((0x1400, 0x1800))
    # The second PDOs of CiA 301's connection set: 300h and 280h.
    assert values(plan, 0x1401, 0x1801) == [
        (0x1401, 1, 0x80000300), (0x1801, 1, 0x80000280),
    ]  # fmt: skip


def run(plan, store):
    """Writes a plan to a store through an SDO server."""
    server, answers = SdoServer(store), []
    sdo = SdoClient(
        "node", 1, lambda frame: answers.append(server.answer(frame.data)),
        timeout=1.0, retries=0,
    )  # fmt: skip
    for _ in write_and_verify("node", sdo, plan):
        sdo.poll(0.0)
        while answers:
            sdo.take(answers.pop(0), 0.0)


def test_a_plan_is_written_and_read_back():
    plan = ConfigPlan(standard_drive())
    plan.require(0x6065, 0, 100, "window")
    plan.require(0x6065, 0, 200, "window")
    store = ObjectStore(plan.device)
    run(plan, store)
    assert store.number(0x6065) == 200


def test_a_value_that_reads_back_differently_is_named():
    plan = ConfigPlan(standard_drive())
    plan.require(0x6065, 0, 100, "window")
    store = ObjectStore(plan.device)
    store.written = lambda index, sub, value: store.set(index, sub, 64)
    with pytest.raises(
        BusError, match=r"window \(6065h:0\) was written 100 and reads 64"
    ):
        run(plan, store)


def test_bit_30_of_a_cob_id_may_read_back_differently():
    plan = ConfigPlan(standard_drive())
    plan.pdo(0x1801, 0x1A01, 0x281, 1, ((0x606C, 0, 32),))
    store = ObjectStore(plan.device)
    # A device without remote frames: it sets bit 30 by itself.
    store.written = lambda index, sub, value: (
        store.set(index, sub, value | 1 << 30) if (index, sub) == (0x1801, 1) else None
    )
    run(plan, store)
    assert store.number(0x1801, 1) == 0x40000281
