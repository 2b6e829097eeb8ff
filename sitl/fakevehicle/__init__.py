"""A fake MAVLink vehicle: the mission protocol of ArduPilot and PX4, with faults on demand.

One module per job:

    cli             command line, ready line, signals
    vehicle         the vehicle itself: state, heartbeat, routing, reboot
    telemetry       the messages it streams or gives out on request
    commands        COMMAND_LONG / COMMAND_INT / SET_MODE
    ftp             plan files over MAVLink FTP
    parameters      the parameter table and its protocol
    mission_server  what both autopilots share of the mission protocol (server side)
    ardupilot, px4  how each of them really behaves: order, refusals, time-outs
    ardupilot_storage, px4_storage  what each keeps of an item, and what it refuses
    persona         what differs between them in numbers
    fence_rules     ArduPilot's validation of an uploaded fence
    plan_files      QGroundControl .plan and QGC WPL 110 files
    items           one mission item, and the three plans
    links           udp, tcp and serial pty
    signing         MAVLink 2 signing
    faults          misbehaviour: what can go wrong, and when
    ground_station  a second ground station that gets in the way
    control         the control channel and scripts
    report          event log and JSON dump
"""
