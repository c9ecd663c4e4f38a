"""The loop process as the host sees it: started, watched, and made safe when it ends."""
