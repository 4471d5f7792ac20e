"""Mean first exit times: walks with noise, until they leave."""
