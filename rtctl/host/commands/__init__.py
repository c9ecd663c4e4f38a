"""What clients ask for, and what becomes of it: requests, lease, targets."""
