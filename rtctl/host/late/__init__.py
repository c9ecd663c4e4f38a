"""Why a tick came late: late ticks, what the kernel counted meanwhile, a verdict with a name."""
