"""Views: each makes its figures once and is updated with pictures often; none computes."""
