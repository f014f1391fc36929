"""The vehicle: the link to it and its recording, the upload, and the practice autopilot to rehearse with."""
