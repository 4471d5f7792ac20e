"""What is estimated from measured records; array work for parts, which import it late."""
