"""A stand-in for IBM Quantum's REST service, as strict as the real one where that is known.

- snapshots: the QPUs, as qiskit-ibm-runtime's fake backends recorded them;
- circuits: what a client sent as circuits, and whether a QPU would take them;
- sampling: running them;
- jobs: jobs, sessions, usage, the limit of submissions; one worker;
- results: both forms of results;
- tokens: IAM;
- faults: misbehaviour on request;
- http: the addresses;
- cli: the command line.
"""
