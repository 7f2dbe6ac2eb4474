"""``quadpips learned-footholds``: footholds that imitate our own foothold search."""
