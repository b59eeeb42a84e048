"""Room acoustics: ray tracing, binaural room impulse responses and audio clips."""
