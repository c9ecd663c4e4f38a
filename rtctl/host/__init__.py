"""The host process: supervises the loop and owns every socket. Ordinary priority, one thread.

`loop_process` starts the loop, `loop_guard` watches it and makes its devices safe when it ends. `Telemetry`
publishes what the loop records, `Gateway` takes requests and writes the newest command, and `endpoints` gives
both a private place to listen. The loop never waits for any of them.

Asked before it runs and beside it: what this machine has to offer (`machine_*`, `rtctl doctor`), what its
devices answer (`probe_*`, `rtctl probe`), and how the system starts it (`service_*`, `rtctl service`)."""
