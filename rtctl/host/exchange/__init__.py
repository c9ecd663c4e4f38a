"""What a host and its clients exchange. Told by the host: samples (`streams`, `publisher`), events, faults
with where they come from (`fault_book`), health, why a tick was late (`late_*`). Asked by clients: what
`gateway` takes, which is requests, lease and targets; who asks may know what is told, and not the other way
round."""
